// Prints what the Khronos validator says of a glTF file, as JSON: `node validate.mjs MODULES FILE.glb`, with the folder
// that the package gltf-validator is installed in.
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { resolve } from 'node:path';

const [modules, file] = process.argv.slice(2);
const validator = createRequire(`${resolve(modules)}/`)('gltf-validator');
const { issues } = await validator.validateBytes(new Uint8Array(readFileSync(file)));
process.stdout.write(`${JSON.stringify(issues)}\n`);
