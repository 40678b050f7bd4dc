// Opens a page in Chromium and prints what a test asks of it, as JSON:
// `node measure.mjs CHROMIUM PAGE.html [LINES]`, with lines of the program apart by commas.
import { writeFileSync } from 'node:fs';
import { pathToFileURL } from 'node:url';
import { Browser } from './chromium.mjs';

const [executable, file, lines = '', pictures = ''] = process.argv.slice(2);
const browser = Browser.start(executable);
try {
  const page = await browser.page(1440, 900);
  const began = Date.now();
  await page.open(pathToFileURL(file).href);
  const measured = { ready_ms: Date.now() - began };
  const isReport = await page.run('Boolean(window.facemill)');
  if (isReport) {
    measured.first_picture_ms = await page.run('facemill.firstPicture');
    measured.motions = await page.run('facemill.motion.n');
    measured.poses = await page.run(`[${lines}].map((line) => facemill.poseOfLine(line).tip)`);
    measured.axes = await page.run(`[${lines}].map((line) => facemill.poseOfLine(line).axis)`);
    measured.lines = await page.run(`[${lines}].map((line) => facemill.program.text(line))`);
    measured.numbers = await page.run(`[${lines}].map((line) => facemill.program.number(line))`);
    // Two moments, as the picture of the scene shows them.
    const shown = (share) => page.run(`(async () => {
      facemill.seek(facemill.motion.total * ${share});
      facemill.view.drawNow();
      const gl = facemill.view.renderer.getContext();
      const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
      const bytes = new Uint8Array(w * h * 4);
      gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
      const colours = new Map();
      let sum = 0;
      for (let k = 0; k < bytes.length; k += 4) {
        const colour = bytes[k] * 65536 + bytes[k + 1] * 256 + bytes[k + 2];
        colours.set(colour, (colours.get(colour) || 0) + 1);
        sum = (sum * 31 + colour) % 4294967291;
      }
      return { colours: colours.size, background: Math.max(...colours.values()) / (w * h), sum };
    })()`);
    measured.shown = [await shown(0.25), await shown(0.6)];
    measured.scrub_ms = await page.run(`(async () => {
      const all = [];
      for (let k = 1; k <= 30; k++) {
        const began = performance.now();
        facemill.seek((facemill.motion.total * ((k * 7) % 31)) / 31);
        facemill.view.drawNow();
        // Reading a pixel waits for the picture.
        facemill.view.renderer.getContext().readPixels(0, 0, 1, 1, 6408, 5121, new Uint8Array(4));
        all.push(performance.now() - began);
        await new Promise((resolve) => requestAnimationFrame(resolve));
      }
      return all;
    })()`);
    // Shapes of a picture in motion, and of the same one at rest.
    measured.motion_shapes = await page.run(`(async () => {
      const { view, motion } = facemill;
      const shapes = () => (view.drawNow(), { triangles: view.renderer.info.render.triangles, segments: view.renderer.info.render.lines, pixels: view.renderer.getPixelRatio() });
      const rested = () => new Promise((resolve) => setTimeout(resolve, 600));
      facemill.seekMotion(motion.n >> 1);
      const moving = shapes();
      await rested();
      const resting = shapes();
      // Of the path that is done, both show the same motions.
      view.setPathDone('done');
      const lastOf = (motions, n) => (n ? motions[n - 1] : -1);
      const done = () => view.paths.map(({ lines }) => Object.values(lines).map(({ object, motions, coarse }) => lastOf(view.isCoarse ? coarse.motions : motions, object.geometry.drawRange.count / 2)));
      const fineDone = done();
      facemill.seekMotion(motion.n >> 1);
      const coarseDone = done();
      const isCoarse = Boolean(view.isCoarse);
      view.setPathDone('all');
      await rested();
      return { isCoarse, moving, resting, fineDone, coarseDone };
    })()`);
    // The stock before the first motion, at its end and at the end of the last one.
    measured.stock = await page.run(`(() => {
      const { stock, view } = facemill;
      if (!stock) return null;
      facemill.toggleGroup('stockNow', true);
      const keyAt = (k) => (facemill.seekMotion(k), stock.shownKey);
      const first = stock.keys[0];
      // Heights of its surface before the program, and the highest triangle: none may bridge a gap.
      keyAt(-1);
      const z = (corner) => stock.positions[3 * stock.indices[corner] + 2];
      const levels = new Set();
      let highest = 0;
      for (let t = 0; t < stock.used; t += 3) {
        const all = [z(t), z(t + 1), z(t + 2)];
        for (const height of all) if (levels.size < 20) levels.add(Math.round(100 * height) / 100);
        highest = Math.max(highest, Math.max(...all) - Math.min(...all));
      }
      const pieces = Math.max(...stock.counts);
      return { levels: [...levels].sort((a, b) => a - b), highest, pieces, keys: stock.keys.length, start: keyAt(-1), before_first: keyAt(first - 2), first: keyAt(first - 1), end: keyAt(facemill.motion.n - 1) };
    })()`);
    // A click on the first finding, and on the path where the tool is.
    measured.finding = await page.run(`(() => {
      const button = document.querySelector('[data-finding]');
      if (!button) return null;
      button.click();
      const finding = facemill.doc.result.findings[Number(button.dataset.finding)];
      return { worst: finding.worst_line, line: facemill.line, shown: document.querySelector('.readout .block').textContent, marked: document.querySelector('.nc-row.now')?.dataset.line };
    })()`);
    measured.clicked = await clickOnPath(page);
    measured.keyboard = await keyboard(page);
    measured.postures = await clickOnNarrowPoint(page);
    measured.tablet = await tablet(page);
    measured.banner = await page.run('document.querySelector(".alarm").textContent');
    measured.sliders = await page.run("[...document.querySelectorAll('[role=slider]')].every((e) => ['min', 'max', 'now'].every((key) => Number.isFinite(parseFloat(e.getAttribute('aria-value' + key)))))");
    measured.shortcut = await shortcutBehindFields(page);
    measured.dialog = await dialog(page);
    measured.labels = await page.run('document.querySelector(".bar h1").textContent + " | " + document.querySelector(".bar .where").textContent');
  }
  // Printing is the same with the sheet open.
  if (isReport) await page.run('facemill.openSheet()');
  await page.send('Emulation.setEmulatedMedia', { media: 'print' });
  measured.sheet = await page.run(`(() => {
    const sheet = document.querySelector('#printed .sheet') || document.querySelector('.sheet');
    const isShown = (element) => element.getClientRects().length > 0;
    return {
      headings: [...sheet.querySelectorAll('h2')].filter(isShown).map((e) => e.textContent),
      sheets: [...document.querySelectorAll('.sheet')].filter(isShown).length,
      rows: [...sheet.querySelectorAll('tr')].filter(isShown).length,
      all_rows: sheet.querySelectorAll('tr').length,
      running: sheet.querySelector('.running').textContent,
      repeats: getComputedStyle(sheet.querySelector('.paged > thead')).display === 'table-header-group' && isShown(sheet.querySelector('.running')),
      stamp: sheet.querySelector('.stamp').firstChild.textContent,
      app_hidden: !document.querySelector('.page') || !isShown(document.querySelector('.page')),
      text: sheet.textContent,
    };
  })()`);
  const { data } = await page.send('Page.printToPDF', { paperWidth: 8.27, paperHeight: 11.69, printBackground: true });
  const pdf = Buffer.from(data, 'base64');
  measured.pdf_pages = (pdf.toString('latin1').match(/\/Type\s*\/Page[^s]/g) || []).length;
  if (pictures) writeFileSync(`${pictures}.pdf`, pdf);
  measured.scripts_run = await page.run('window.hostile === undefined ? [] : window.hostile');
  // Chromium that draws by the processor warns that it copies each picture.
  measured.problems = page.problems.filter((text) => !text.includes('GPU stall due to ReadPixels'));
  measured.requests = page.requests.filter((url) => !url.startsWith('data:') && !url.startsWith('blob:'));
  process.stdout.write(`${JSON.stringify(measured)}\n`);
} finally {
  await browser.close();
}

/** Presses a key where the focus is. */
async function press(page, key) {
  for (const type of ['keyDown', 'keyUp']) await page.send('Input.dispatchKeyEvent', { type, key, code: key });
}

/** Whether a shortcut works where a checkbox or a slider has the focus. */
async function shortcutBehindFields(page) {
  const works = {};
  for (const type of ['checkbox', 'range']) {
    await page.run(`facemill.setMeasure(false); document.querySelector('.groups input[type=${type}]').focus()`);
    await press(page, 'm');
    works[type] = await page.run('Boolean(facemill.measuring)');
  }
  await page.run('facemill.setMeasure(false)');
  return works;
}

/** The sheet as a dialog: its role, where the focus is while it is open and behind that. */
async function dialog(page) {
  await page.run("document.querySelector('.play').focus(); facemill.openSheet()");
  const open = await page.run("({ role: facemill.cover.getAttribute('role'), has_focus: facemill.cover.contains(document.activeElement) })");
  await press(page, 'Escape');
  return { ...open, is_open: await page.run("facemill.cover.classList.contains('open')"), returns: await page.run("document.activeElement.classList.contains('play')") };
}

/** Lines to which keys in the program's text lead. */
async function keyboard(page) {
  const line = () => page.run('facemill.line');
  await page.run("facemill.select('program'); facemill.seekLine(1); document.querySelector('.nc').focus()");
  const lines = [];
  for (const key of ['ArrowDown', 'ArrowDown', 'ArrowUp', 'End', 'Home']) {
    await press(page, key);
    lines.push(await line());
  }
  await press(page, 'ArrowDown');
  const now = await page.run("document.getElementById(document.querySelector('.nc').getAttribute('aria-activedescendant'))?.dataset.line");
  return { lines, n: await page.run('facemill.program.n'), now };
}

/** Clicks on a mark of a narrow point; returns what is shown then. */
async function clickOnNarrowPoint(page) {
  const place = await page.run(`(() => {
    const { doc, view } = facemill;
    if (!doc.postures || !doc.postures.maps.length) return null;
    facemill.select('postures');
    view.look('top');
    view.drawNow();
    const box = view.renderer.domElement.getBoundingClientRect();
    const all = doc.postures.maps.map((map, k) => ({ k, at: view.onScreen(map.tip_mm), tip: map.tip_mm }));
    const free = all.filter(({ k, at }) => view.narrowPointAt(at.x, at.y) === k && document.elementFromPoint(at.x + box.left, at.y + box.top) === view.renderer.domElement);
    facemill.select('program');
    return free.length ? { k: free.at(-1).k, x: free.at(-1).at.x + box.left, y: free.at(-1).at.y + box.top } : null;
  })()`);
  if (!place) return null;
  await page.click(place.x, place.y);
  return page.run(`(() => {
    const map = facemill.doc.postures.maps[${place.k}];
    const { tip } = facemill.machine.pose(facemill.q);
    const canvas = document.querySelector('.posture-map');
    const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
    const colours = new Set();
    for (let k = 0; k < data.length; k += 4) colours.add(data[k] * 65536 + data[k + 1] * 256 + data[k + 2]);
    return {
      wanted: ${place.k}, shown: facemill.postures.index, is_open: document.querySelector('.panel.postures').classList.contains('open'),
      off_mm: Math.hypot(...tip.map((x, c) => x - map.tip_mm[c])), colours: colours.size, maps: facemill.doc.postures.maps.length,
    };
  })()`);
}

/** Controls that are outside of a narrow window, or under something else. */
async function tablet(page) {
  const found = {};
  for (const [width, height] of [[820, 1180], [1180, 820]]) {
    await page.send('Emulation.setDeviceMetricsOverride', { width, height, deviceScaleFactor: 1, mobile: false });
    await new Promise((resolve) => setTimeout(resolve, 150));
    found[width] = await page.run(`(() => {
      const root = document.documentElement;
      const wrong = [];
      for (const panel of Object.keys(facemill.panels)) {
        facemill.select(panel);
        for (const element of document.querySelectorAll('.page button, .page select, .page input, .page canvas')) {
          if (!element.getClientRects().length) continue;
          element.scrollIntoView({ block: 'nearest', inline: 'nearest' });
          const box = element.getBoundingClientRect();
          const name = panel + ': ' + (element.getAttribute('aria-label') || element.textContent || element.tagName);
          // A map may be higher than its panel, which scrolls.
          const isHigh = element.tagName !== 'CANVAS' && (box.top < -0.5 || box.bottom > ${height} + 0.5);
          if (box.left < -0.5 || box.right > ${width} + 0.5 || isHigh) wrong.push(name + ' is outside');
          else if (element.tagName !== 'CANVAS') {
            const top = document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2);
            if (!top || !(element.contains(top) || top.contains(element))) wrong.push(name + ' is under ' + (top && top.className));
          }
        }
      }
      facemill.select('program');
      const view = document.querySelector('.view').getBoundingClientRect();
      return { overflow: Math.max(0, root.scrollWidth - ${width}, document.body.scrollWidth - ${width}), wrong: [...new Set(wrong)], view: [view.width, view.height] };
    })()`);
  }
  await page.send('Emulation.setDeviceMetricsOverride', { width: 1440, height: 900, deviceScaleFactor: 1, mobile: false });
  return found;
}

/** Clicks where the tip is in the middle of the program; returns its line and the line shown then. */
async function clickOnPath(page) {
  const places = await page.run(`(() => {
    const { motion, view } = facemill;
    facemill.closeCover();
    facemill.view.look('top');
    view.drawNow();
    const box = view.renderer.domElement.getBoundingClientRect();
    const found = [];
    for (let k = 1; k < motion.n; k += Math.max(1, Math.floor(motion.n / 400))) {
      if (!motion.kinds[k]) continue;
      const { tip } = facemill.machine.pose(motion.position(k, 0.5));
      const at = view.onScreen(tip);
      const [x, y] = [at.x + box.left, at.y + box.top];
      if (document.elementFromPoint(x, y) === view.renderer.domElement && view.motionAt(at.x, at.y, 2) === k) found.push({ x, y, line: motion.lines[k] });
    }
    return found;
  })()`);
  if (!places.length) return null;
  const { x, y, line } = places[Math.floor(places.length / 2)];
  await page.click(x, y);
  return { line, shown: await page.run('facemill.line') };
}
