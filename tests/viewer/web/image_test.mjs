// Images of a file in the viewer for browsers, without a browser: image_test.mjs WEB_FOLDER FOLDER
// FOLDER: textured_scene.mjs' mesh as lossless.vcp and, with JPEGs, as jpeg.vcp; VIEW.json, VIEW.pfm, VIEW.png: a
// camera, and what the program sees from there of the first one, 320 x 200, a ray a pixel, unlit; channels.vcp: the mesh
// with channels, channels.pfm and .png: what it sees of that one from close.json, lit.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { CasterHere, Ranges, check, checks, joined, opened, quick, server } from './module_use.mjs';
import { compareColours, readDepth, readPicture } from './native_picture.mjs';

const folder = process.argv[3];
const read = name => fs.readFileSync(path.join(folder, name));
const lossless = read('lossless.vcp'), jpegs = read('jpeg.vcp');
const kUnlit = 2, kBudget = 64 << 20;
const [width, height] = [320, 200];

/// Where a file's section of images is (FileHeader::images), and where its first tile begins.
function sectionOf(bytes) {
    const at = 184 + 24 * 22 + 64, [offset, size] = [at, at + 8].map(from => Number(bytes.readBigUInt64LE(from)));
    const rows = 24 * bytes.readUInt32LE(at + 24) + 16 * bytes.readUInt32LE(at + 28);
    return { begin: offset, end: offset + size, tables: offset + rows, tiles: Number(bytes.readBigUInt64LE(offset + rows)) };
}

function viewOf(name, more = {}) {
    const { position, target, fov_degrees } = JSON.parse(read(`${name}.json`));
    return { eye: position, forward: target.map((x, i) => x - position[i]), up: [0, 1, 0], fov: fov_degrees * Math.PI / 180, width, height,
        mode: kUnlit, ...more };
}

/// A scan that is opened, whose bytes come exactly as they are missing.
class Scan {
    static async of(bytes, { budget = kBudget, decode = () => null } = {}) {
        const made = new Scan();
        Object.assign(made, { bytes, decode, section: sectionOf(bytes), asked: [], problems: [], decoded: [] });
        const serve = server(bytes);
        made.ranges = quick(new Ranges('scan.vcp', (url, request) => {
            const [first, last] = /bytes=(\d+)-(\d+)/.exec(request.headers.Range).slice(1).map(Number);
            made.asked.push({ offset: first, bytes: last + 1 - first });
            return serve(url, request);
        }));
        made.module = await opened(made.ranges, budget);
        return made;
    }
    askedOfImages() {
        return this.asked.filter(({ offset, bytes }) => offset + bytes > this.section.begin && offset < this.section.end - 64);
    }

    /// One turn of the worker's loop. `withImages`: their bytes come, too. Returns the update.
    async turn(withImages = true) {
        const update = this.module.update();
        if (update.problem) this.problems.push(update.problem);
        if (update.drawable && update.awaitsRays) this.draw();
        for (const jpeg of this.module.jpegs()) {
            this.decoded.push(jpeg);
            this.module.putJpeg(jpeg.id, this.decode(jpeg));
        }
        for (const { offset, bytes } of joined(this.module.missing(), 0, Infinity))
            if (withImages || offset < this.section.begin) this.module.supply(offset, await this.ranges.read(offset, bytes));
        return update;
    }
    /// Goes on until nothing is missing. Returns the last update.
    async settle(view) {
        return this.until(view, true, update => update.settled);
    }
    /// Returns the picture of all pages that a view wants, as it is without images.
    async pictureOfVertices(view) {
        await this.until(view, false, update => update.drawable && update.pagesMissing === 0 && !update.awaitsRays);
        return this.draw();
    }
    async until(view, withImages, isDone) {
        this.module.look(view);
        for (let turn = 0; turn < 500; ++turn) {
            const update = await this.turn(withImages);
            if (isDone(update)) return update;
        }
        assert.fail('it does not end');
    }
    draw() {
        const begun = this.module.beginSample(0), { pixels } = this.module.castBands({ width, height }, begun.rows, 0, begun.bands, true);
        this.module.endSample(begun);
        return pixels;
    }
}
async function pictureOfVertices(bytes, view) {
    return (await Scan.of(bytes)).pictureOfVertices(view);
}
const same = (a, b) => a.length === b.length && a.every((value, i) => value === b[i]);
const imageBytes = module => module.needed(0, height).list.reduce((sum, { key, bytes }) => sum + (key < 0 ? bytes : 0), 0);

for (const name of ['whole', 'close']) await check(`colours are the native ones: ${name}`, async () => {
    const scan = await Scan.of(lossless), view = viewOf(name), vertices = await pictureOfVertices(lossless, view);
    await scan.settle(view);
    assert.deepEqual(scan.problems, []);
    const depth = readDepth(path.join(folder, `${name}.pfm`), width, height), theirs = readPicture(path.join(folder, `${name}.png`));
    const isHit = i => Number.isFinite(depth[i]);
    const { differ, counted, most } = compareColours(scan.draw(), theirs, 1, isHit);
    console.log(`   ${differ} of ${counted} pixels differ by more than 1 of 255, at most by ${most}`);
    assert.ok(counted > 30000 && differ <= counted / 1000);
    assert.ok(compareColours(vertices, theirs, 1, isHit).differ > counted / 2, 'vertices have other colours');
});

await check('channels are lit as the program lights them, by others, too', async () => {
    const bytes = read('channels.vcp'), scan = await Scan.of(bytes), view = viewOf('close', { mode: 0 });
    await scan.settle(view);
    assert.deepEqual(scan.problems, []);
    const depth = readDepth(path.join(folder, 'channels.pfm'), width, height), theirs = readPicture(path.join(folder, 'channels.png'));
    const ours = scan.draw(), { differ, counted, most } = compareColours(ours, theirs, 2, i => Number.isFinite(depth[i]));
    console.log(`   ${differ} of ${counted} pixels differ by more than 2 of 255, at most by ${most}`);
    assert.ok(counted > 30000 && differ <= counted / 500);
    const other = await CasterHere.beside(scan.module, 64 << 20), begun = scan.module.beginSample(0);
    const part = other.caster.fit(scan.module, begun.rows, { first: 0, count: begun.bands });
    const done = await other.caster.cast(scan.module, { view, sample: 0, begun, shows: true }, part);
    assert.ok(done.pixels.length > 0 && same(done.pixels, ours.subarray(0, done.pixels.length)));
    await scan.settle({ ...view, plain: true });
    const plain = scan.draw();
    assert.ok(compareColours(plain, ours, 2, i => Number.isFinite(depth[i])).differ > counted / 4, 'plain light is another');
    await scan.settle(view);
    assert.ok(same(scan.draw(), ours));
});

await check('the first picture does not wait for images; no byte is asked for twice', async () => {
    const scan = await Scan.of(lossless), view = viewOf('close');
    scan.module.look(view);
    let update = await scan.turn();
    while (!update.drawable) {
        assert.deepEqual(scan.askedOfImages(), []);
        update = await scan.turn();
    }
    assert.ok(!update.settled);
    await scan.settle(view);
    const bytes = scan.asked.reduce((sum, one) => sum + one.bytes, 0);
    const sorted = scan.asked.sort((a, b) => a.offset - b.offset);
    sorted.slice(1).forEach((one, i) => assert.ok(sorted[i].offset + sorted[i].bytes <= one.offset, `byte ${one.offset}`));
    console.log(`   ${bytes} bytes of ${lossless.length}`);
    // From afar fewer levels are read; what is there is not read again.
    const far = await Scan.of(lossless), whole = viewOf('whole', { width: 32, height: 20 });
    await far.settle(whole);
    const ofImages = far.askedOfImages().reduce((sum, one) => sum + one.bytes, 0);
    assert.ok(ofImages < 0.2 * (far.section.end - far.section.begin), `${ofImages} bytes`);
    const { requests } = far.ranges;
    await far.settle(whole);
    assert.equal(far.ranges.requests, requests);
});

await check('nothing of images is asked for while no page that is drawn shows one', async () => {
    const scan = await Scan.of(lossless);
    await scan.settle(viewOf('whole', { errorPixels: 100 }));
    assert.deepEqual(scan.askedOfImages(), []);
    // Pages that came meanwhile are known to show them.
    const view = viewOf('whole');
    await scan.settle(view);
    const other = await Scan.of(lossless);
    await other.settle(view);
    assert.ok(same(scan.draw(), other.draw()));
});

await check('images take half of the budget at most', async () => {
    for (const budget of [5 << 20, 8 << 20]) {
        const scan = await Scan.of(lossless, { budget }), update = await scan.settle(viewOf('close'));
        const bytes = imageBytes(scan.module);
        console.log(`   ${update.residentBytes} bytes of pages and ${bytes} of images of ${budget}`);
        assert.ok(update.relaxed && update.residentBytes <= budget / 2);
        assert.ok(bytes > budget / 16 && bytes <= budget / 2);
    }
});

await check('others cast from copies of tiles what the first one does', async () => {
    let tilesLeftOut = 0, partsLeft = 0;
    const scan = await Scan.of(lossless);
    for (const shareBytes of [64 << 20, 2 << 20]) {
        const other = await CasterHere.beside(scan.module, shareBytes);
        for (const more of [{}, { mode: 0, shadows: true }]) for (const name of ['whole', 'close', 'whole']) {
            const view = viewOf(name, more);
            await scan.settle(view);
            const begun = scan.module.beginSample(0), { rows, bands } = begun;
            const tiles = scan.module.needed(0, height).tiles.length;
            for (const [first, count] of [[0, bands - 1], [bands - 1, 1]]) {
                const alone = scan.module.castBands(view, rows, first, count, true).pixels;
                const part = other.caster.fit(scan.module, rows, { first, count });
                partsLeft += part.count < count ? 1 : 0;
                if (part.count === 0) continue;
                tilesLeftOut += tiles - part.needed.tiles.length;
                const done = await other.caster.cast(scan.module, { view, sample: 0, begun, shows: true }, part);
                assert.ok(same(done.pixels, alone.subarray(0, done.pixels.length)), JSON.stringify({ more, name, first, shareBytes }));
                assert.ok(other.caster.heldBytes <= shareBytes);
            }
        }
    }
    console.log(`   ${tilesLeftOut / 16} tiles were not needed; ${partsLeft} parts were too large`);
    assert.ok(tilesLeftOut > 0 && partsLeft > 0);
});

await check('JPEGs are decoded by the page, each once', async () => {
    const colour = [10, 200, 30, 255], view = viewOf('close');
    const decode = jpeg => Uint8ClampedArray.from({ length: 4 * jpeg.width * jpeg.height }, (_, i) => colour[i % 4]);
    const scan = await Scan.of(jpegs, { decode });
    await scan.settle(view);
    assert.deepEqual(scan.problems, []);
    for (const { bytes } of scan.decoded) assert.deepEqual([...bytes.subarray(0, 2)], [0xff, 0xd8]);
    const all = scan.decoded.map(({ bytes }) => Buffer.from(bytes).toString('latin1'));
    assert.ok(all.length > 8 && new Set(all).size === all.length);
    const pixels = scan.draw();
    let shown = 0;
    for (let i = 0; i < pixels.length; i += 4) shown += colour.every((value, channel) => Math.abs(pixels[i + channel] - value) <= 1) ? 1 : 0;
    console.log(`   ${all.length} JPEGs; ${shown} pixels show what they were decoded to`);
    assert.ok(shown > 10000);
    await scan.settle(view);
    assert.equal(scan.decoded.length, all.length);
});

await check('a JPEG that cannot be decoded is one line, and the colours of vertices are drawn', async () => {
    const view = viewOf('close'), vertices = await pictureOfVertices(jpegs, view);
    const short = ({ width, height }) => new Uint8ClampedArray(4 * width * height - 4);
    for (const decode of [() => null, short]) {
        const scan = await Scan.of(jpegs, { decode });
        await scan.settle(view);
        assert.ok(scan.problems.length > 0 && new Set(scan.problems).size === scan.problems.length);
        for (const line of scan.problems) assert.match(line, /^scan.vcp.*tile \d+.*is a JPEG that the browser does not decode$/);
        const sorted = scan.asked.sort((a, b) => a.offset - b.offset);
        sorted.slice(1).forEach((one, i) => assert.ok(sorted[i].offset + sorted[i].bytes <= one.offset, 'it is not fetched again'));
        assert.ok(same(scan.draw(), vertices));
    }
});

await check('damaged tiles and tables: one line, and the colours of vertices', async () => {
    const view = viewOf('close'), vertices = await pictureOfVertices(lossless, view), { tables, tiles, end } = sectionOf(lossless);
    const says = async (change, expected) => {
        const broken = Buffer.from(lossless);
        change(broken);
        const scan = await Scan.of(broken);
        await scan.settle(view);
        assert.ok(scan.problems.length > 0);
        for (const line of scan.problems) assert.match(line, expected);
        assert.ok(scan.asked.length < 60, `${scan.asked.length} requests`);
        return scan;
    };
    const all = await says(bytes => bytes.subarray(tiles, end - 64).forEach((_, i) => { bytes[tiles + i] ^= 1; }), /tile \d+.*hash does not match/);
    assert.ok(same(all.draw(), vertices));
    assert.equal(all.problems.length, 2, 'one for each image');
    const one = await says(bytes => { bytes[end - 300] ^= 1; }, /tile \d+.*hash does not match/);
    assert.ok(!same(one.draw(), vertices));
    const none = await says(bytes => { bytes[tables + 8] ^= 1; }, /images.*hash does not match/);
    assert.ok(same(none.draw(), vertices));
    assert.equal(none.problems.length, 1);
});

console.log(`${checks} checks passed`);
