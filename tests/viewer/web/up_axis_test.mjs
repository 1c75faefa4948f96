// A browser finds the axis that points up as the program does: up_axis_test.mjs CAMERA_JS CASES_JSON
import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

const [cameraFile, casesFile] = process.argv.slice(2);
// Read as a module whatever the nearest package.json says.
fs.copyFileSync(cameraFile, 'camera.mjs');
const { upOf } = await import(pathToFileURL(path.resolve('camera.mjs')));
for (const { what, low, high, up } of JSON.parse(fs.readFileSync(casesFile, 'utf8')))
    assert.equal(upOf(low, high), up ?? 'y', what);
