// Builds the scripts of the page into dist, with the hashes that the content security policy names
// and the list of the files that they were made from.
import { createHash } from 'node:crypto';
import { copyFileSync, mkdirSync, readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { build } from 'esbuild';

const sha256 = (bytes) => createHash('sha256').update(bytes).digest();

mkdirSync('dist', { recursive: true });
await build({
  entryPoints: ['src/report.js', 'src/sheet.js'],
  outdir: 'dist',
  bundle: true,
  minify: true,
  format: 'iife',
  target: ['chrome100', 'firefox113', 'safari16.4'],
  charset: 'ascii',
  legalComments: 'none',
});
for (const name of ['report.js', 'sheet.js']) {
  // Within a script no end tag may stand.
  const text = readFileSync(`dist/${name}`, 'utf8').trimEnd().replaceAll('</script', '<\\/script').replaceAll('<!--', '<\\!--');
  writeFileSync(`dist/${name}`, text);
  writeFileSync(`dist/${name}.sha256`, `${sha256(text).toString('base64')}\n`);
}
copyFileSync('node_modules/three/LICENSE', 'dist/three.LICENSE.txt');
const sources = readdirSync('src').map((name) => `src/${name}`);
const built = readdirSync('dist').filter((name) => name !== 'files.txt').map((name) => `dist/${name}`);
const files = ['build.mjs', 'package.json', 'package-lock.json', ...sources, ...built].sort();
writeFileSync('dist/files.txt', files.map((name) => `${sha256(readFileSync(name)).toString('hex')}  ${name}\n`).join(''));
