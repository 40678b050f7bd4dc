// Draws the pictures of docs/report-page.md: `node pictures.mjs CHROMIUM REPORT.html FOLDER`.
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { Browser } from './chromium.mjs';

const [executable, file, folder] = process.argv.slice(2);
const browser = Browser.start(executable);
const steps = [
  ['page-scene', 'facemill.seek(facemill.motion.total * 0.3)'],
  ['page-machine', `facemill.setFrameMode('machine'); facemill.seekLine(facemill.doc.result.worst?.clearance_line ?? 1); facemill.setFigure('clearance'); facemill.setPlot('figures'); facemill.plotSelect.value = 'figures'; facemill.view.look('tool')`],
  ['page-deviation', `facemill.setFrameMode('part'); facemill.select('surface'); facemill.setSurface('deviation'); facemill.toggleGroup('head', false); facemill.toggleGroup('tool', false); facemill.view.look('iso')`],
  ['page-postures', `facemill.setSurface('plain'); facemill.setFigure('surface_tilt'); facemill.toggleGroup('tool', true); facemill.toggleGroup('head', true); facemill.select('postures'); facemill.postures.show(facemill.doc.postures.maps.reduce((best, map, k, all) => (map.proven[0] < all[best].proven[0] ? k : best), 0)); facemill.view.look('tool')`],
  ['page-sheet', `facemill.openSheet()`],
];
try {
  const page = await browser.page(1280, 800);
  await page.open(pathToFileURL(file).href);
  for (const [name, step] of steps) {
    await page.run(`(async () => { ${step}; await new Promise((resolve) => setTimeout(resolve, 600)); })()`);
    const { data } = await page.send('Page.captureScreenshot', { format: 'webp', quality: 82 });
    writeFileSync(join(folder, `${name}.webp`), Buffer.from(data, 'base64'));
  }
} finally {
  await browser.close();
}
