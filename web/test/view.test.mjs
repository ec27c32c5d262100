// Has its view write pages, opens them in a real browser without network, and uses them as people do.
//   node test/view.test.mjs ITS [FOLDER]      ITS: the program, or a page that it wrote; FOLDER: for screenshots
// CHROMIUM names the browser (/usr/bin/chromium). Exit status 0 if all is well, 1 and a message if not.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { chromium } from 'playwright-core';

const [program, folder] = process.argv.slice(2);
const executablePath = process.env.CHROMIUM ?? '/usr/bin/chromium';
assert.ok(program, 'usage: view.test.mjs ITS [FOLDER]');
assert.ok(existsSync(executablePath), `there is no browser ${executablePath}; install chromium, or name one in CHROMIUM`);
if (folder) mkdirSync(folder, { recursive: true });
const workshop = mkdtempSync(join(tmpdir(), 'its-view-'));

/// A bulging torus, or a part of it: open, without inside.
function writeTorus(file, part) {
  const around = 32, along = 64, lines = [];
  for (let i = 0; i <= along; ++i)
    for (let j = 0; j < around; ++j) {
      const a = (2 * Math.PI * part * i) / along, b = (2 * Math.PI * j) / around;
      const r = 0.4 + 0.12 * Math.cos(3 * a) * Math.cos(2 * b);
      lines.push(`v ${(1 + r * Math.cos(b)) * Math.cos(a)} ${(1 + r * Math.cos(b)) * Math.sin(a)} ${r * Math.sin(b)}`);
    }
  const vertex = (i, j) => 1 + ((part === 1 ? i % along : i) * around + (j % around));
  for (let i = 0; i < along; ++i)
    for (let j = 0; j < around; ++j)
      lines.push(`f ${vertex(i, j)} ${vertex(i + 1, j)} ${vertex(i + 1, j + 1)} ${vertex(i, j + 1)}`);
  writeFileSync(file, lines.join('\n') + '\n');
}

function writePage(name, part, ...options) {
  const at = (extension) => join(workshop, `${name}.${extension}`);
  writeTorus(at('obj'), part);
  execFileSync(program, ['build', at('obj'), '-o', at('its'), '--depth', '5', '-q']);
  execFileSync(program, ['view', at('its'), '-o', at('html'), '-q', ...options]);
  return at('html');
}

const own = !program.endsWith('.html');
// The title would end the data if it were not escaped.
const file = own ? writePage('torus', 1, '--title', 'Torus </script><b>&') : program;

const browser = await chromium.launch({
  executablePath,
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
         '--disable-background-networking', '--disable-component-update', '--disable-sync', '--no-first-run'],
});

const problems = [];
const context = await browser.newContext({ viewport: { width: 840, height: 480 }, colorScheme: 'light' });
await context.setOffline(true);
const page = await context.newPage();
page.on('console', (message) => {
  // The software renderer of the test machine warns about its own speed.
  if (message.type() === 'error' || (message.type() === 'warning' && !message.text().includes('GPU stall')))
    problems.push(`${message.type()}: ${message.text()}`);
});
page.on('pageerror', (error) => problems.push(`exception: ${error.message}`));
page.on('request', (request) => {
  if (!/^(file|data|blob):/.test(request.url())) problems.push(`request: ${request.url()}`);
});

// Screenshots are decoded and compared within the browser, which has a decoder; here they are but numbers.
const reader = await context.newPage();
await reader.evaluate(() => {
  const kinds = {
    drawn: ([r, g, b], [r0, g0, b0]) => Math.max(Math.abs(r - r0), Math.abs(g - g0), Math.abs(b - b0)) > 40,
    red: ([r, g, b]) => r > g + 30 && r > b + 30,
    strongRed: ([r, g, b]) => r > g + 75 && r > b + 75,
    blue: ([r, g, b]) => b > r + 30 && b > g + 5,
  };
  const pictures = [];
  window.add = async (text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const bitmap = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d', { willReadFrequently: true });
    context.drawImage(bitmap, 0, 0);
    return pictures.push(context.getImageData(0, 0, bitmap.width, bitmap.height).data) - 1;
  };
  /// The part of the pixels in which two pictures differ visibly.
  window.difference = (i, j) => {
    const a = pictures[i], b = pictures[j];
    if (a.length !== b.length) throw new Error('pictures of different sizes');
    let differing = 0;
    for (let k = 0; k < a.length; k += 4)
      differing += Math.max(Math.abs(a[k] - b[k]), Math.abs(a[k + 1] - b[k + 1]), Math.abs(a[k + 2] - b[k + 2])) > 12;
    return differing / (a.length / 4);
  };
  /// The part of the pixels of a kind.
  window.share = (i, kind) => {
    const a = pictures[i], corner = [...a.subarray(0, 3)];
    let count = 0;
    for (let k = 0; k < a.length; k += 4) count += kinds[kind]([a[k], a[k + 1], a[k + 2]], corner);
    return count / (a.length / 4);
  };
  window.cornerBrightness = (i) => (pictures[i][0] + pictures[i][1] + pictures[i][2]) / 3;
});
const difference = (a, b) => reader.evaluate(([i, j]) => window.difference(i, j), [a, b]);
const share = (a, kind) => reader.evaluate(([i, k]) => window.share(i, k), [a, kind]);
const brightness = (a) => reader.evaluate((i) => window.cornerBrightness(i), a);

let shots = 0;
async function shoot(name) {
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  ++shots;
  if (folder) await page.screenshot({ path: `${folder}/${String(shots).padStart(2, '0')}-${name}.png` });
  const png = await page.locator('#stage').screenshot();
  return reader.evaluate((text) => window.add(text), png.toString('base64'));
}

async function check(name, test) {
  try {
    await test();
    console.log(`ok    ${name}`);
  } catch (error) {
    problems.push(`${name}: ${error.message}`);
    console.log(`FAIL  ${name}: ${error.message}`);
  }
}
const atLeast = (value, least, what) => assert.ok(value >= least, `${what}: ${value.toFixed(4)}, at least ${least} expected`);
const atMost = (value, most, what) => assert.ok(value <= most, `${what}: ${value.toFixed(4)}, at most ${most} expected`);

async function open(name) {
  await page.goto(pathToFileURL(resolve(name)).href);
  await page.waitForSelector('html[data-ready=true]', { timeout: 30000 });
}

try {
  await open(file);
  const data = JSON.parse(await page.locator('#its-data').textContent());
  const first = await shoot('first');

  await check('the canvas is not blank', async () => atLeast(await share(first, 'drawn'), 0.05, 'drawn'));
  await check('the numbers of the build are shown', async () => {
    const text = await page.locator('#facts').textContent();
    for (const [label, value] of data.facts) assert.ok(text.includes(label) && text.includes(value), label);
    assert.ok((await page.locator('#title').textContent()).includes(data.title));
  });

  await page.locator('#cut').uncheck();
  const whole = await shoot('whole');
  await check('the cut switch works', async () => atLeast(await difference(first, whole), 0.01, 'changed'));

  const bodies = ['outer', 'mesh', 'inner'].filter((name) => data[name]);
  for (const name of bodies) await page.locator(`#show-${name}`).uncheck();
  const nothing = await shoot('nothing');
  for (const name of bodies)
    await check(`the switch of the ${name} body works`, async () => {
      await page.locator(`#show-${name}`).check();
      const shown = await shoot(`only-${name}`);
      atLeast(await difference(shown, nothing), 0.02, 'changed');
      if (name === 'outer') atLeast(await share(shown, 'red'), 0.02, 'red');
      if (name === 'inner') atLeast(await share(shown, 'blue'), 0.02, 'blue');
      await page.locator(`#show-${name}`).uncheck();
    });
  await check('switched on again, all is as before', async () => {
    for (const name of bodies) await page.locator(`#show-${name}`).check();
    atMost(await difference(await shoot('again'), whole), 0.001, 'differs from before');
  });
  await check('opacity works', async () => {
    await page.locator('#opacity-outer').fill('1');
    const opaque = await shoot('opaque');
    atLeast(await difference(opaque, whole), 0.01, 'changed');
    atLeast(await share(opaque, 'strongRed'), (await share(whole, 'strongRed')) + 0.01, 'red');
    await page.locator('#opacity-outer').fill('0.3');
  });

  await page.locator('#cut').check();
  await check('the cut plane moves', async () => {
    await page.locator('#at').fill('0.7');
    atLeast(await difference(await shoot('moved'), first), 0.005, 'changed');
    await page.locator('#at').fill('0.5');
    atMost(await difference(await shoot('moved-back'), first), 0.001, 'differs from before');
  });
  await check('the field is drawn on the plane', async () => {
    await page.locator('[data-field=off]').click();
    const off = await shoot('field-off');
    await page.locator('[data-field=everywhere]').click();
    const everywhere = await shoot('field-everywhere');
    atLeast(await difference(off, everywhere), 0.1, 'changed');
    atLeast(await share(everywhere, 'red'), 0.05, 'red');
    await page.locator('[data-field=inside]').click();
  });
  await check('axes and flip work', async () => {
    const before = await shoot('inside');
    await page.locator('[data-axis=x]').click();
    const across = await shoot('axis-x');
    atLeast(await difference(across, before), 0.01, 'axis');
    await page.locator('#flip').click();
    atLeast(await difference(await shoot('flipped'), across), 0.01, 'flip');
  });
  await check('views work', async () => {
    await page.locator('[data-view=top]').click();
    const top = await shoot('top');
    await page.locator('[data-view=front]').click();
    atLeast(await difference(await shoot('front'), top), 0.02, 'changed');
    await page.locator('[data-view=reset]').click();
  });
  await check('the mouse turns the model', async () => {
    const before = await shoot('before-drag');
    const frames = Number(await page.locator('html').getAttribute('data-frames'));
    await page.mouse.move(200, 200);
    await page.mouse.down();
    await page.mouse.move(320, 230, { steps: 4 });
    await page.mouse.up();
    await page.waitForFunction((n) => Number(document.documentElement.dataset.frames) > n, frames);
    atLeast(await difference(await shoot('dragged'), before), 0.02, 'changed');
    await page.keyboard.press('r');
    await page.evaluate(() => document.activeElement.blur());  // its focus is shown
    atMost(await difference(await shoot('reset'), before), 0.001, 'differs from before');
  });
  await check('the keyboard works', async () => {
    const before = await shoot('before-keys');
    await page.keyboard.press('c');
    assert.equal(await page.locator('#cut').isChecked(), false);
    await page.keyboard.press('2');
    assert.equal(await page.locator('#show-mesh').isChecked(), false);
    await page.keyboard.press('ArrowLeft');
    atLeast(await difference(await shoot('keys'), before), 0.02, 'changed');
  });
  await check('light and dark', async () => {
    const light = await shoot('light');
    await page.locator('#theme').click();
    atLeast((await brightness(light)) - (await brightness(await shoot('dark'))), 100, 'darker');
  });
  await check('a narrow screen has room for both', async () => {
    await page.setViewportSize({ width: 420, height: 800 });
    await shoot('narrow');
    const stage = await page.locator('#stage').boundingBox(), panel = await page.locator('#panel').boundingBox();
    atLeast(stage.height, 300, 'height of the picture');
    atLeast(panel.height, 200, 'height of the panel');
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth > innerWidth), false);
  });
  if (own)
    await check('an open mesh: one surface on both sides, and the page says so', async () => {
      await page.setViewportSize({ width: 840, height: 480 });
      await open(writePage('open', 0.6, '--max-triangles', '4000'));
      atLeast(await share(await shoot('open'), 'drawn'), 0.05, 'drawn');
      assert.ok(await page.locator('#show-inner').isDisabled());
      assert.ok(await page.locator('#show-outer').isEnabled());
      const notes = await page.locator('#notes').textContent();
      assert.match(notes, /shown with .* merged for display/);
      assert.match(notes, /The outer surface is extracted on/);
    });
} catch (error) {
  problems.push(error.message);
} finally {
  await browser.close();
  rmSync(workshop, { recursive: true });
}
for (const problem of problems) console.error(`its view: ${problem}`);
process.exit(problems.length ? 1 : 0);
