// What tests of the viewer's module without a browser share. The first argument of each is the folder of the viewer.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

const web = process.argv[2];
const file = name => import(pathToFileURL(path.join(web, name)));
export const { Module } = await file('module.js');
export const { Files, MissingFile, Ranges, joined, parseContentRange, urgentFirst, without } = await file('ranges.js');
export const { Choice } = await file('choice.js');
export const { Caster, costsOf, partsOf } = await file('share.js');
export const { Orbit, kFieldOfView, movingScale } = await file('camera.js');
export const wasm = fs.readFileSync(path.join(web, 'vcp.wasm'));

export let checks = 0;
export async function check(name, run) {
    await run();
    ++checks;
    console.log(`ok ${name}`);
}

/// A server of one file in memory. `change(answer)`: what it does wrong.
export function server(bytes, change = answer => answer) {
    return async (url, { headers }) => {
        const [first, last] = /bytes=(\d+)-(\d+)/.exec(headers.Range).slice(1).map(Number);
        const part = bytes.subarray(first, Math.min(last + 1, bytes.length));
        return change(new Response(part, {
            status: 206, headers: { 'Content-Range': `bytes ${first}-${first + part.length - 1}/${bytes.length}` },
        }));
    };
}
export const quick = ranges => Object.assign(ranges, { delay: 1 });

export async function supply(module, ranges) {
    for (const { offset, bytes } of joined(module.missing(), 32 << 10, 256 << 10))
        try {
            module.supply(offset, await ranges.read(offset, bytes));
        } catch (error) {
            // As the worker does.
            if (!(error instanceof MissingFile && module.placeOf(offset).name !== '')) throw error;
            module.lose(offset, error.message);
        }
}

export async function opened(ranges, budget = 64 << 20) {
    const module = await Module.load(wasm);
    const lead = await ranges.read(0, 64 << 10);
    module.begin(ranges.size, 'scan.vcp', budget);
    module.supply(0, lead);
    if (ranges instanceof Files) ranges.placeOf = offset => module.placeOf(offset);
    while (!module.open()) await supply(module, ranges);
    return module;
}

export function look(module, orbit, width = 320, height = 200, errorPixels = 0.5) {
    const { up, forward } = orbit.axes();
    module.look({ eye: orbit.eye(), forward, up, fov: kFieldOfView, width, height, errorPixels });
}

/// Casts a sample of the picture in its bands; returns its depth.
export function cast(module, sample = 0, width = 320, height = 200) {
    const begun = module.beginSample(sample), depth = new Float32Array(width * height);
    for (let band = 0; band < begun.bands; ++band) {
        module.castBands({ width, height }, begun.rows, band, 1, false);
        const row = band * begun.rows;
        depth.set(module.depth(width * Math.min(begun.rows, height - row)), width * row);
    }
    if (sample === 0) module.endSample(begun);
    return depth;
}

/// Goes on until nothing is missing, as the worker does; returns the last update. `decode(jpeg)`: its texels.
export async function settle(module, ranges, budget, decode = () => null) {
    for (let round = 0; round < 1000; ++round) {
        const update = module.update();
        assert.equal(update.problem, null);
        assert.ok(update.residentBytes <= budget, 'the budget holds');
        if (update.drawable && update.awaitsRays) cast(module);
        if (update.settled) return update;
        await supply(module, ranges);
        for (const jpeg of module.jpegs()) module.putJpeg(jpeg.id, decode(jpeg));
    }
    assert.fail('it does not settle');
}

export const hitsOf = depth => depth.reduce((sum, x) => sum + (Number.isFinite(x) ? 1 : 0), 0);

/// A worker that casts, in this thread.
export class CasterHere {
    static async beside(first, shareBytes) {
        const made = new CasterHere();
        made.module = await Module.load(first.compiled);
        made.module.follow(first.lead());
        made.caster = new Caster(made, shareBytes);
        made.onmessage({ data: { type: 'ready' } });
        return made;
    }
    postMessage({ view, sample, begun, needed, tables, copies, dropped, first, count, shows }) {
        if (tables) this.module.followImages(tables);
        for (const key of dropped) this.module.drop(key);
        for (const { key, bytes } of copies) this.module.take(key, bytes);
        this.module.look(view);
        const { rows } = this.module.beginCopied(needed, sample, begun);
        const done = this.module.castBands(view, rows, first, count, shows);
        setTimeout(() => this.onmessage({ data: { type: 'cast', ...done, said: this.module.said(), memoryBytes: 0 } }));
    }
}
