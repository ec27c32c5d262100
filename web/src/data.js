// Decodes what the tool writes into the page: JSON with arrays as base64 of deflated bytes.

async function inflate(base64) {
  const packed = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/// Whole numbers: each the difference to the one `stride` before it, zigzag, stored byte plane by byte plane.
async function decodeIntegers(base64, stride) {
  const bytes = await inflate(base64);
  const count = bytes.length / 4;
  const values = new Int32Array(count);
  for (let i = 0; i < count; ++i) {
    const z = bytes[i] | (bytes[count + i] << 8) | (bytes[2 * count + i] << 16) | (bytes[3 * count + i] << 24);
    const difference = (z >>> 1) ^ -(z & 1);
    values[i] = (i >= stride ? values[i - stride] : 0) + difference;
  }
  return values;
}

async function decodeBody(body) {
  if (!body) return null;
  const steps = await decodeIntegers(body.positions, 3);
  const positions = Float32Array.from(steps, (v) => v * body.step);
  const indices = new Uint32Array((await decodeIntegers(body.indices, 3)).buffer);
  return { positions, indices };
}

export async function readData(text) {
  const data = JSON.parse(text);
  const [outer, mesh, inner] = await Promise.all([data.outer, data.mesh, data.inner].map(decodeBody));
  const steps = await decodeIntegers(data.field.values, 1);
  return {
    ...data,
    bodies: { outer, mesh, inner },
    field: { ...data.field, values: Float32Array.from(steps, (v) => v * data.field.step) },
    palette: Uint8Array.from(atob(data.palette), (c) => c.charCodeAt(0)),
  };
}
