// The cut plane, with the field's colours on it. Lengths are relative to the model's longest side.
import * as THREE from 'three';

const vertexShader = `
out vec3 at;
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  at = world.xyz;
  gl_Position = projectionMatrix * viewMatrix * world;
}`;

// Lines and the shell are drawn by the part of the pixel in which a ≤ f ≤ b, as in the tool's own pictures.
const fragmentShader = `
precision highp float;
precision highp sampler3D;
in vec3 at;
out vec4 colour;
uniform sampler3D field;
uniform sampler2D palette;
uniform vec3 low, size, samples;
uniform float range, inner, outer, lineWidth;
uniform bool hasInside, insideOnly;

float band(float f, float slope, float a, float b) {
  return clamp((min(f + 0.5 * slope, b) - max(f - 0.5 * slope, a)) / slope, 0.0, 1.0);
}
float line(float f, float slope, float level, float width) {
  return band(f, slope, level - 0.5 * width * slope, level + 0.5 * width * slope);
}
void main() {
  vec3 part = (at - low) / size;
  float f = texture(field, (part * (samples - 1.0) + 0.5) / samples).r;
  // |∇f| is at most about √3: what is steeper is no slope, but the border of the screen's 2 × 2 blocks.
  float slope = clamp(length(vec2(dFdx(f), dFdy(f))), 1e-7, 1.8 * length(fwidth(at)));
  // Only now: derivatives are undefined beside pixels that are gone.
  if (any(lessThan(part, vec3(0.0))) || any(greaterThan(part, vec3(1.0)))) discard;
  if (insideOnly && f > outer + lineWidth * slope) discard;
  float t = sign(f) * sqrt(min(abs(f) / range, 1.0));
  vec3 c = texture(palette, vec2((128.0 * t + 128.5) / 257.0, 0.5)).rgb;
  float nearest = 0.05 * round(f / 0.05);
  if (nearest != 0.0) c = mix(c, vec3(0.07), 0.2 * line(f, slope, nearest, lineWidth));
  c = mix(c, vec3(1.0, 0.886, 0.478), 0.65 * band(f, slope, inner, outer));
  if (hasInside) {
    c = mix(c, vec3(0.125, 0.55, 0.33), line(f, slope, 0.0, 1.3 * lineWidth));
    if (inner < 0.0) c = mix(c, vec3(0.08, 0.3, 0.58), line(f, slope, inner, 1.3 * lineWidth));
  }
  c = mix(c, vec3(0.675, 0.11, 0.17), line(f, slope, outer, 1.3 * lineWidth));
  colour = vec4(c, 1.0);
}`;

function fieldTexture({ values, samples }) {
  const half = Uint16Array.from(values, THREE.DataUtils.toHalfFloat);
  const texture = new THREE.Data3DTexture(half, ...samples);
  texture.format = THREE.RedFormat;
  texture.type = THREE.HalfFloatType;
  texture.internalFormat = 'R16F';
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}

function paletteTexture(rgb) {
  const rgba = new Uint8Array(257 * 4).fill(255);
  for (let i = 0; i < 257; ++i) rgba.set(rgb.subarray(3 * i, 3 * i + 3), 4 * i);
  const texture = new THREE.DataTexture(rgba, 257, 1);
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

/// What is kept is the side with normal · x ≤ offset.
export class CutPlane {
  constructor(data) {
    const { field } = data;
    this.normal = new THREE.Vector3(1, 0, 0);
    this.offset = 0;
    this.clipping = new THREE.Plane();
    this.uniforms = {
      field: { value: fieldTexture(field) },
      palette: { value: paletteTexture(data.palette) },
      low: { value: new THREE.Vector3(...field.low) },
      size: { value: new THREE.Vector3(...field.size) },
      samples: { value: new THREE.Vector3(...field.samples) },
      range: { value: 0.5 },
      inner: { value: data.epsilon_inner },
      outer: { value: data.epsilon_outer },
      hasInside: { value: data.has_inside },
      insideOnly: { value: true },
      lineWidth: { value: 1.5 },
    };
    const material = new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3, vertexShader, fragmentShader, uniforms: this.uniforms, side: THREE.DoubleSide,
    });
    this.object = new THREE.Mesh(new THREE.PlaneGeometry(4, 4), material);
    this.frame = new THREE.LineLoop(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: 0x888c94 }));
    this.box = new THREE.Box3(this.uniforms.low.value.clone(),
                              this.uniforms.low.value.clone().add(this.uniforms.size.value));
  }

  place(normal, offset) {
    this.normal.copy(normal);
    this.offset = offset;
    this.clipping.normal.copy(normal).negate();
    this.clipping.constant = offset;
    this.object.position.copy(normal).multiplyScalar(offset);
    this.object.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), normal);
    this.frame.geometry.setFromPoints(this.outline());
  }

  /// The polygon in which the plane cuts the field's box.
  outline() {
    const corner = (i) => new THREE.Vector3(i & 1 ? this.box.max.x : this.box.min.x,
                                            i & 2 ? this.box.max.y : this.box.min.y,
                                            i & 4 ? this.box.max.z : this.box.min.z);
    const points = [];
    for (let i = 0; i < 8; ++i) {
      for (const bit of [1, 2, 4]) {
        if (i & bit) continue;
        const a = corner(i), b = corner(i | bit);
        const ha = a.dot(this.normal) - this.offset, hb = b.dot(this.normal) - this.offset;
        if (ha > 0 !== hb > 0) points.push(a.lerp(b, ha / (ha - hb)));
      }
    }
    const centre = points.reduce((sum, p) => sum.add(p), new THREE.Vector3()).divideScalar(points.length || 1);
    const right = new THREE.Vector3(1, 0, 0).applyQuaternion(this.object.quaternion);
    const up = new THREE.Vector3(0, 1, 0).applyQuaternion(this.object.quaternion);
    const angle = (p) => Math.atan2(p.clone().sub(centre).dot(up), p.clone().sub(centre).dot(right));
    return points.sort((a, b) => angle(a) - angle(b));
  }
}
