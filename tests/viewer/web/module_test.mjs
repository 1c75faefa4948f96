// The viewer for browsers without a browser: its module opens, streams and draws a scan; wrong servers and hostile files
// end in one line. Usage: node module_test.mjs WEB_FOLDER SCAN.vcp HOSTILE [VIEW]...
// HOSTILE: what hostile_files wrote.
// VIEW.json: a camera; VIEW.pfm: the depth that the program sees from there, 320 x 200.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import {
    CasterHere, Choice, Files, Module, Orbit, Ranges, cast, check, checks, costsOf, hitsOf, joined, kFieldOfView, look, movingScale, opened, parseContentRange,
    partsOf, quick, server, settle, supply, urgentFirst, wasm, without,
} from './module_use.mjs';
import { compareDepth, readDepth } from './native_picture.mjs';

const [, scan, hostile, ...natives] = process.argv.slice(2);
const file = fs.readFileSync(scan);

await check('content ranges', () => {
    assert.deepEqual(parseContentRange('bytes 0-9/20'), { first: 0, last: 9, size: 20 });
    for (const wrong of [null, '', 'bytes */20', 'bytes 9-0/20', 'bytes 0-20/20', 'bytes 0-9/*'])
        assert.equal(parseContentRange(wrong), null);
});

await check('stretches are joined', () => {
    const far = [{ offset: 100, bytes: 10 }, { offset: 0, bytes: 10 }, { offset: 12, bytes: 4 }];
    assert.deepEqual(joined(far, 2, 1000), [{ offset: 0, bytes: 16 }, { offset: 100, bytes: 10 }]);
    assert.equal(joined(far, 2, 12).length, 3);
    assert.deepEqual(without(far, [{ offset: 5, bytes: 100 }]), [{ offset: 105, bytes: 5 }, { offset: 0, bytes: 5 }]);
    assert.deepEqual(without(far, []), far);
    assert.deepEqual(without([{ offset: 0, bytes: 10 }], [{ offset: 2, bytes: 3 }]), [{ offset: 0, bytes: 2 }, { offset: 5, bytes: 5 }]);
    assert.deepEqual(urgentFirst(joined(far, 2, 1000), far).map(run => run.offset), [100, 0]);
});

await check('first picture: at most 3 requests and 400 KB', async () => {
    const ranges = new Ranges('scan.vcp', server(file));
    const module = await opened(ranges), orbit = new Orbit(), info = module.info();
    orbit.fit(info.boundsMin, info.boundsMax, 1.6);
    look(module, orbit);
    let update = module.update();
    while (!update.drawable) {
        await supply(module, ranges);
        update = module.update();
    }
    assert.ok(hitsOf(cast(module)) > 3000);
    assert.ok(ranges.requests <= 3, `${ranges.requests} requests`);
    assert.ok(ranges.bytes <= 400e3, `${ranges.bytes} bytes`);
    console.log(`   ${ranges.requests} requests, ${ranges.bytes} bytes`);
});

await check('no byte is asked for twice, though pages lie across what came', async () => {
    const module = await Module.load(wasm), orbit = new Orbit(), asked = [{ offset: 0, bytes: 64 << 10 }];
    module.begin(file.length, 'scan.vcp', 64 << 20);
    module.supply(0, file.subarray(0, 64 << 10));
    const supplyMissing = () => {
        for (const { offset, bytes } of module.missing()) {
            assert.ok(asked.every(one => offset >= one.offset + one.bytes || offset + bytes <= one.offset), `byte ${offset}`);
            asked.push({ offset, bytes });
            // It comes in two pieces.
            module.supply(offset, file.subarray(offset, offset + (bytes >> 1)));
            module.supply(offset + (bytes >> 1), file.subarray(offset + (bytes >> 1), offset + bytes));
        }
    };
    while (!module.open()) supplyMissing();
    const info = module.info();
    orbit.fit(info.boundsMin, info.boundsMax, 1.6);
    orbit.zoom(0.2, 0, 0);
    look(module, orbit);
    for (let update = module.update(); !update.settled; update = module.update()) {
        if (update.drawable && update.awaitsRays) cast(module);
        supplyMissing();
    }
    assert.ok(asked.some(one => one.offset === 64 << 10), 'a page lies across');
});

await check('whole and close: settles within the budget, antialiases', async () => {
    for (const budget of [64 << 20, 2 << 20]) {
        const ranges = new Ranges('scan.vcp', server(file)), module = await opened(ranges, budget), info = module.info();
        const orbit = new Orbit();
        orbit.fit(info.boundsMin, info.boundsMax, 1.6);
        for (const nearer of [1, 0.2]) {
            orbit.zoom(nearer, 0, 0);
            look(module, orbit);
            const update = await settle(module, ranges, budget);
            assert.ok(hitsOf(cast(module)) > 3000);
            if (!update.relaxed && nearer === 1) assert.ok(update.errorPixels <= 0.5 || info.certifiedError > 0);
            cast(module, 1);
            const hit = module.pick(160, 100);
            assert.ok(hit && hit.error > 0 && hit.depth > 0);
        }
    }
});

await check('how far a point may be off is what the pages say that are drawn there', async () => {
    const ranges = new Ranges('scan.vcp', server(file)), module = await opened(ranges), info = module.info(), orbit = new Orbit();
    orbit.fit(info.boundsMin, info.boundsMax, 1.6);
    look(module, orbit, 32, 20, 1e-3);
    let first = module.update();
    for (; !first.drawable; first = module.update()) await supply(module, ranges);
    assert.ok(first.pagesInCut === 1 && !first.settled);
    const coarse = module.pick(16, 10);
    await settle(module, ranges, 64 << 20);
    const fine = module.pick(16, 10);
    console.log(`   at first ${coarse.error}, then ${fine.error}; ${Math.abs(coarse.depth - fine.depth)} apart`);
    assert.ok(coarse.error > 2 * fine.error && fine.error === info.certifiedError);
    assert.ok(Math.abs(coarse.depth - fine.depth) <= coarse.error + fine.error);
});

const limits = [];
for (const name of natives) await check(`the picture and its pages are the native ones: ${name}`, async () => {
    const [width, height] = [320, 200], said = JSON.parse(fs.readFileSync(`${name}.said`));
    const camera = JSON.parse(fs.readFileSync(`${name}.json`)), forward = camera.target.map((x, i) => x - camera.position[i]);
    const ranges = new Ranges('scan.vcp', server(file)), module = await opened(ranges), info = module.info();
    const view = { eye: camera.position, forward, up: [0, 1, 0], fov: camera.fov_degrees * Math.PI / 180, width, height };
    module.look({ ...view, colourError: name === 'tolerant' ? 10 : 6 });
    const update = await settle(module, ranges, 64 << 20);
    assert.deepEqual([update.pagesInCut, update.limitedBy], [said.subvolumes_in_cut, said.limited_by]);
    const isSame = (ours, theirs) => Math.abs(ours - theirs) <= 1e-9 * theirs;
    assert.ok(isSame(update.errorPixels, said.error_pixels) && isSame(update.colourPixels, said.colour_pixels));
    limits.push(update.limitedBy);
    const theirs = readDepth(`${name}.pfm`, width, height);
    const { differ, hits } = compareDepth(cast(module), theirs, 1e-3 * info.cell);
    console.log(`   ${differ} of ${width * height} pixels differ beyond 1e-3 cell; ${hits} hits`);
    assert.ok(hits > (update.pagesInCut > 1 ? 3000 : 30) && differ <= width * height / 1000);
});
assert.deepEqual(limits, ['geometry', 'geometry', 'colour', 'geometry'], 'from far away, colours are off first');

await check('bands are shared out by what they cost', () => {
    assert.deepEqual(partsOf([1, 1, 1, 1], 2), [{ first: 0, count: 2 }, { first: 2, count: 2 }]);
    assert.deepEqual(partsOf([9, 1, 1, 1], 2), [{ first: 0, count: 1 }, { first: 1, count: 3 }]);
    assert.deepEqual(partsOf([1], 3).map(part => part.count), [0, 1, 0]);
    assert.deepEqual(costsOf([], 2), [1, 1]);
    assert.deepEqual(costsOf([1, 2], 4), [1, 1, 2, 2]);
    assert.deepEqual(costsOf([1, 2, 3, 4], 2), [2, 4]);
});

await check('resolution follows the time that moving pictures take', () => {
    for (const fullMs of [1, 20, 49, 51, 80, 300, 1000, 3000]) {
        let scale = 0.4;
        for (let frame = 0; frame < 12; ++frame) scale = movingScale(scale, fullMs * scale ** 2);
        const ms = fullMs * scale ** 2;
        assert.ok(ms <= 50 && (scale === 1 || ms > 25), `${fullMs}: ${scale}`);
        assert.equal(movingScale(scale, ms), scale, 'it rests');
    }
    let scale = 0.4;
    for (let frame = 0; frame < 12; ++frame) scale = movingScale(scale, 1e5);
    assert.equal(scale, 0.1, 'no less than that');
});

await check('bands cast from copies are those of the pool; no more is copied than is allowed', async () => {
    const ranges = new Ranges('scan.vcp', server(file)), module = await opened(ranges), info = module.info();
    const middle = info.boundsMin.map((x, i) => (x + info.boundsMax[i]) / 2), section = { normal: [1, 0, 0], offset: middle[0] };
    const pixelsOf = (view, bands) => module.castBands(view, bands.rows, bands.first, bands.count, true).pixels;
    let pagesLeftOut = 0, partsLeft = 0;
    for (const shareBytes of [64 << 20, 500e3]) {
        const other = await CasterHere.beside(module, shareBytes);
        for (const more of [{}, { mode: 7 }, { shadows: true }, { occlusionRays: 4 }, { section }, { environment: 2 }]) for (const nearer of [1, 0.3]) {
            const orbit = new Orbit();
            orbit.fit(info.boundsMin, info.boundsMax, 1.6);
            orbit.zoom(nearer, 0.2, 0.3);
            const { up, forward } = orbit.axes(), view = { eye: orbit.eye(), forward, up, fov: kFieldOfView, width: 320, height: 200, ...more };
            module.look(view);
            const { pagesInCut } = await settle(module, ranges, 64 << 20);
            for (const sample of more.mode ? [0] : [0, 1]) {
                // A sample is added to what one cast of the samples before.
                const begun = module.beginSample(sample), { bands, rows } = begun, rest = bands - (bands >> 1);
                const alone = pixelsOf(view, { rows, first: bands >> 1, count: rest });
                const part = other.caster.fit(module, rows, { first: bands >> 1, count: rest });
                partsLeft += part.count < rest ? 1 : 0;
                if (part.count === 0) continue;
                pagesLeftOut += pagesInCut - part.needed.list.length;
                const done = await other.caster.cast(module, { view, sample, begun, shows: true }, part);
                assert.deepEqual(done.pixels, alone.subarray(0, done.pixels.length), JSON.stringify({ more, nearer, sample }));
                assert.ok(other.caster.heldBytes <= shareBytes);
            }
        }
    }
    console.log(`   ${pagesLeftOut} pages were not needed; ${partsLeft} parts were too large`);
    assert.ok(pagesLeftOut > 0 && partsLeft > 0);
});

await check('a scan in shards is drawn as the file is, from the shards that it needs', async () => {
    const asked = new Set(), inFolder = (url, request) => {
        const name = decodeURI(url).replace(/[?].*/, '').split('/').pop();
        asked.add(name);
        assert.ok(url.endsWith('?key=a'), url);
        return server(fs.readFileSync(`shards/${name}`))(url, request);
    };
    const whole = new Ranges('scan.vcp', server(fs.readFileSync('large.vcp'))), shards = new Files('folder/manifest.vcps?key=a', inFolder);
    const alone = await opened(whole), module = await opened(shards);
    assert.deepEqual(module.info(), alone.info());
    assert.deepEqual(alone.placeOf(2 ** 40), { name: '', offset: 2 ** 40 }, 'one file may have any size');
    const orbit = new Orbit(), info = module.info();
    orbit.fit(info.boundsMin, info.boundsMax, 1.6);
    look(module, orbit);
    for (let update = module.update(); !update.drawable; update = module.update()) await supply(module, shards);
    console.log(`   first picture: ${shards.requests} requests, ${shards.bytes} bytes`);
    assert.ok(shards.requests <= 5, `${shards.requests} requests`);
    for (const zoom of [1, 0.1]) {
        orbit.zoom(zoom, 0.3, 0.1);
        look(module, orbit);
        look(alone, orbit);
        const updates = [await settle(module, shards, 64 << 20), await settle(alone, whole, 64 << 20)];
        for (const is of ['errorPixels', 'residentBytes']) assert.equal(updates[0][is], updates[1][is], is);
        assert.deepEqual(cast(module), cast(alone));
    }
    console.log(`   settled twice: ${shards.requests} requests, ${whole.requests} of the file; ${asked.size - 1} shards`);
});

await check('of a shard that is not there one line tells, and the others are shown', async () => {
    const names = fs.readdirSync('shards').filter(name => name.endsWith('.vcp')), problems = new Map();
    let unharmed = 0, drawn = 0;
    for (const gone of names) {
        let asked = 0;
        const inFolder = async (url, request) => {
            const name = url.split('/').pop();
            if (name !== gone) return server(fs.readFileSync(`shards/${name}`))(url, request);
            ++asked;
            return new Response('', { status: 404 });
        };
        const shards = new Files('folder/manifest.vcps', inFolder);
        let module = null;
        try {
            module = await opened(shards);
        } catch (error) {
            assert.match(error.message, /the server has no such file/); // it has the directory
            continue;
        }
        const orbit = new Orbit(), info = module.info();
        orbit.fit(info.boundsMin, info.boundsMax, 1.6);
        look(module, orbit);
        let update = null;
        for (let round = 0; round < 1000 && !update?.settled; ++round) {
            update = module.update();
            if (update.problem) problems.set(gone, update.problem);
            if (update.drawable && update.awaitsRays) cast(module);
            await supply(module, shards);
        }
        assert.ok(update.settled, `${gone}: it settles`);
        assert.ok(asked <= 8, `${gone} was asked for ${asked} times`);
        if (update.drawable) assert.ok(hitsOf(cast(module)) > 1000);
        drawn += update.drawable ? 1 : 0;
        if (asked > 0) assert.match(problems.get(gone) ?? '', new RegExp(`${gone}: the server has no such file`));
        else ++unharmed;
    }
    console.log(`   ${problems.size} of ${names.length} shards were missed, ${unharmed} not needed; ${drawn} pictures`);
    assert.ok(problems.size > 1 && drawn >= names.length - 2, 'one shard has the directory, and one the coarsest page');
});

await check('what rays hit counts the same, whoever cast them', async () => {
    const ranges = [0, 1].map(() => new Ranges('scan.vcp', server(file)));
    const [alone, first] = await Promise.all(ranges.map(each => opened(each))), other = await CasterHere.beside(first, 64 << 20);
    const orbit = new Orbit(), info = first.info();
    orbit.fit(info.boundsMin, info.boundsMax, 1.6);
    orbit.zoom(0.3, 0.2, 0.3);
    const { up, forward } = orbit.axes(), view = { eye: orbit.eye(), forward, up, fov: kFieldOfView, width: 320, height: 200 };
    alone.look(view);
    first.look(view);
    for (let round = 0; ; ++round) {
        const updates = [alone.update(), first.update()];
        assert.deepEqual(updates[0], updates[1], `round ${round}`);
        if (updates[0].settled) break;
        if (updates[0].drawable) {
            cast(alone);
            const begun = first.beginSample(0), { bands, rows } = begun;
            const part = other.caster.fit(first, rows, { first: 2, count: bands - 2 });
            const done = other.caster.cast(first, { view, sample: 0, begun, shows: false }, part);
            first.castBands(view, rows, 0, 2, false);
            first.hear((await done).said);
            first.endSample(begun);
        }
        await supply(alone, ranges[0]);
        await supply(first, ranges[1]);
    }
});

await check('servers that do wrong end in one line', async () => {
    const says = async (change, expected, requests) => {
        const ranges = quick(new Ranges('scan.vcp', server(file, change)));
        await assert.rejects(opened(ranges), error => expected.test(error.message) && !error.message.includes('\n'));
        if (requests) assert.equal(ranges.requests, requests);
    };
    await says(() => new Response(file, { status: 200 }), /ignores ranges/, 1);
    await says(() => new Response('', { status: 404 }), /no such file/, 1);
    await says(() => new Response('', { status: 503 }), /answers 503/, 4);
    await says(answer => new Response(answer.body, { status: 206, headers: { 'Content-Range': 'bytes 7-9/99' } }), /another range/, 1);
    await says(answer => new Response(answer.body, { status: 206 }), /hides Content-Range/, 1);
});

await check('a connection of which nothing is heard any more is given up, a slow one is not', async () => {
    const slow = quick(new Ranges('scan.vcp', async (url, { headers, signal }) => {
        const answer = await server(file)(url, { headers }), bytes = new Uint8Array(await answer.arrayBuffer());
        let at = 0;
        const body = new ReadableStream({ async pull(to) {
            await new Promise(done => setTimeout(done, 30));
            assert.ok(!signal.aborted);
            to.enqueue(bytes.subarray(at, at += 20));
            if (at >= bytes.length) to.close();
        } });
        return new Response(body, answer);
    }));
    slow.silentMs = 200;
    assert.ok(Buffer.from(await slow.read(0, 500)).equals(file.subarray(0, 500)));
    assert.deepEqual([slow.requests, slow.bytes], [1, 500]);
    // One says nothing at all, the other one stops half-way.
    const silent = (url, { signal }) => new Promise((_, fail) => signal.addEventListener('abort', () => fail(signal.reason)));
    const stops = async (url, { headers, signal }) => new Response(new ReadableStream({ start(to) {
        to.enqueue(new Uint8Array(10));
        signal.addEventListener('abort', () => to.error(signal.reason));
    } }), await server(file)(url, { headers }));
    for (const fetch of [silent, stops]) {
        const ranges = quick(new Ranges('scan.vcp', fetch));
        ranges.silentMs = 20;
        await assert.rejects(ranges.read(0, 100), /^Error: scan.vcp: the server does not answer$/);
        assert.equal(ranges.requests, 4);
        // It answers again.
        ranges.fetch = server(file);
        assert.ok(Buffer.from(await ranges.read(0, 100)).equals(file.subarray(0, 100)));
    }
});

await check('a small file is asked for once', async () => {
    const ranges = quick(new Ranges('scan.vcp', server(file.subarray(0, 1000))));
    assert.equal((await ranges.read(0, 64 << 10)).length, 1000);
    assert.equal(ranges.requests, 1);
});

await check('a file replaced while it is seen', async () => {
    let tag = '"a"';
    const ranges = quick(new Ranges('scan.vcp', server(file, answer => (answer.headers.set('ETag', tag), answer))));
    await ranges.read(0, 100);
    tag = '"b"';
    await assert.rejects(ranges.read(100, 100), /replaced/);
});

await check('a damaged page is reported and its parent drawn', async () => {
    const whole = new Ranges('scan.vcp', server(file)), info = (await opened(whole)).info();
    if (info.pages < 4) return;
    const broken = Buffer.from(file);
    broken[file.length - 64 - 300] ^= 1; // in the last page
    const ranges = quick(new Ranges('scan.vcp', server(broken))), module = await opened(ranges), orbit = new Orbit();
    orbit.fit(info.boundsMin, info.boundsMax, 1.6);
    orbit.zoom(0.05, 0, 0);
    look(module, orbit, 320, 200, 1e-3);
    let problem = null, update;
    for (let round = 0; round < 300 && !update?.settled; ++round) {
        update = module.update();
        problem ??= update.problem;
        if (update.drawable && update.awaitsRays) cast(module);
        await supply(module, ranges);
    }
    assert.ok(update.settled);
    assert.match(problem ?? '', /page \d+.*hash does not match/);
});

await check('every bit of the first block flipped: refused in one line, or harmless', async () => {
    const module = await Module.load(wasm);
    for (let bit = 0; bit < 8 * 256; bit += 7) {
        const broken = Buffer.from(file);
        broken[bit >> 3] ^= 1 << (bit & 7);
        module.begin(broken.length, 'scan.vcp', 8 << 20);
        module.supply(0, broken);
        assert.throws(() => module.open(), error => error.message.length > 0 && !error.message.includes('\n'));
    }
});

/// The files of hostile_files, each with the line that the program's reader says to it.
function* hostileFiles() {
    const bytes = fs.readFileSync(hostile);
    for (let at = 0; at < bytes.length;) {
        const [fileEnd, lineEnd] = [8 + bytes.readUInt32LE(at), 8 + bytes.readUInt32LE(at) + bytes.readUInt32LE(at + 4)];
        yield { content: bytes.subarray(at + 8, at + fileEnd), line: bytes.toString('utf8', at + fileEnd, at + lineEnd) };
        at += lineEnd;
    }
}

/// Opens what one may, looks at it from near and far, and points at it. Returns the line that says why not, or '', and
/// whether anything was drawn, how many JPEGs were decoded, and how many tiles of images were there.
function useHostile(module, content) {
    module.begin(content.length, 'fuzz.vcp', 8 << 20);
    module.supply(0, content);
    try {
        assert.ok(module.open());
    } catch (error) {
        if (error instanceof WebAssembly.RuntimeError) throw error;
        return { said: error.message, isDrawn: false, decoded: 0, levels: 0 };
    }
    const orbit = new Orbit(), info = module.info();
    let isDrawn = false, decoded = 0, tiles = 0;
    orbit.fit(info.boundsMin, info.boundsMax, 1);
    for (const nearer of [1, 0.05]) {
        orbit.zoom(nearer, 0, 0);
        look(module, orbit, 32, 32);
        for (let round = 0; round < 8; ++round) {
            const update = module.update();
            assert.ok(!update.problem?.includes('\n'));
            for (const { id, width, height } of module.jpegs()) {
                decoded += id % 4 === 0 ? 0 : 1;
                module.putJpeg(id, id % 4 === 0 ? null : new Uint8Array(4 * width * height));
            }
            if (update.drawable) {
                cast(module, 0, 32, 32);
                module.pick(16, 16);
                if (module.gpuBegin(0).images > 0) module.gpuImages();
                tiles = Math.max(tiles, module.needed(0, 32).tiles.length / 16);
                isDrawn = true;
            }
            if (update.settled) break;
        }
    }
    return { said: '', isDrawn, decoded, tiles };
}

await check('WebGL draws once it has shown that it does so rightly, and faster', () => {
    const width = 100, rows = 32, count = width * rows, shown = { width, height: 100, mode: 0 };
    /// What comes of it where the processor sees `depth` and `colour`, and WebGL seen(i) and coloured(i), in `took`
    /// milliseconds instead of `ms`: 'chosen', 'open' or 'closed'.
    const judged = ({ depth = 5, colour = 0xff102030, seen = () => depth, coloured = () => colour, ms = 40, took = 0, drawn = true, view = shown }) => {
        const gpu = {
            isWrong: false, isClosed: false, isLost() { return this.isWrong; }, isReady: () => true, close() { this.isClosed = true; },
            draw() {
                for (const end = performance.now() + took; performance.now() < end;);
                if (!drawn) throw new RangeError('no memory');
                return {};
            },
            rowsShown: () => ({ colours: Uint32Array.from({ length: count }, (_, i) => coloured(i)), depth: Float32Array.from({ length: count }, (_, i) => seen(i)) }),
        };
        const module = {
            wasm: {}, gpuKind: () => ({}), info: () => ({ cell: 2 }), beginSample: () => ({ bands: 3, rows }),
            castBands: () => ({ pixels: new Uint8ClampedArray(Uint32Array.from({ length: count }, () => colour).buffer) }),
            depth: () => new Float32Array(count).fill(2 * depth),
        };
        const choice = Object.assign(new Choice(module, null, () => {}), { gpu, begun: true });
        assert.ok(!choice.isGpus(view));
        if (choice.isOpen(view, ms)) choice.judge(view, ms);
        assert.ok(!choice.isOpen(view, ms), 'a view is judged once');
        assert.equal(choice.gpu === null, gpu.isClosed, 'what is done without gives its memory back');
        return choice.isGpus(view) ? 'chosen' : choice.gpu === null ? 'closed' : choice.isOpen({ ...view, mode: 0 }, 40) ? 'open' : 'unknown';
    };
    assert.equal(judged({}), 'chosen');
    assert.equal(judged({ seen: i => (i % 200 === 0 ? 3e38 : 5) }), 'chosen', 'edges may differ');
    assert.equal(judged({ seen: () => -5 }), 'chosen', 'caps of sections');
    assert.equal(judged({ seen: i => (i % 20 === 0 ? 3e38 : 5) }), 'closed', 'holes');
    assert.equal(judged({ seen: () => 5.002 }), 'closed');
    assert.equal(judged({ seen: () => NaN }), 'closed');
    assert.equal(judged({ coloured: () => 0xff302010 }), 'closed', 'red and blue changed places');
    assert.equal(judged({ depth: Infinity, seen: () => 5 }), 'closed', 'what is not there is not seen');
    assert.equal(judged({ depth: Infinity, seen: () => 3.1e38 }), 'open', 'nothing is seen by either');
    assert.equal(judged({ took: 50 }), 'closed', 'slower');
    assert.equal(judged({ ms: 10 }), 'open', 'it does not matter');
    assert.equal(judged({ view: { ...shown, mode: 8 } }), 'open', 'false colours are not drawn');
    assert.equal(judged({ drawn: false }), 'closed', 'whatever is thrown');
});

await check('what WebGL draws with: rows are copied once, the table has the cut, and what rays say counts', async () => {
    const ranges = quick(new Ranges('large.vcp', server(fs.readFileSync('large.vcp')))), module = await opened(ranges), orbit = new Orbit(), info = module.info();
    orbit.fit(info.boundsMin, info.boundsMax, 1.6);
    look(module, orbit);
    const kInCut = 256, kRecordWords = 12;
    const draw = () => {
        const begun = module.gpuBegin(0), table = module.wordsAt(module.wasm.vcp_gpu_table(), kRecordWords * begun.records);
        const records = Array.from({ length: begun.records }, (_, i) => i).filter(i => table[kRecordWords * i] & kInCut);
        assert.ok(records.length > 0);
        for (const i of records) assert.ok(table[kRecordWords * i + 3] < begun.poolRows * 1024, 'pages lie in the texture');
        const marks = new Uint32Array(begun.records).fill(1), grid = new Uint32Array(4 * 384);
        module.gpuEnd(begun, grid, begun.asksRays ? marks : null);
        return { begun, rows: module.gpuRows(begun).reduce((sum, row) => sum + row.count, 0), records };
    };
    let rows = 0, update, asked = 0;
    for (let round = 0; round < 1000 && !update?.settled; ++round) {
        update = module.update();
        if (update.drawable && (update.changed || update.awaitsRays)) {
            const drawn = draw();
            rows += drawn.rows;
            asked += drawn.begun.asksRays;
            assert.equal(module.gpuBegin(0).copies, 0, 'what was copied stays');
            if (drawn.begun.asksRays) assert.equal(module.gpuBegin(0).asksRays, 0, 'rays are asked once');
        }
        if (!update.settled) await supply(module, ranges);
    }
    console.log(`   ${rows} rows copied for ${update.residentBytes} bytes of pages, rays asked ${asked} times`);
    assert.ok(update.settled && asked > 0 && rows * 16384 >= update.residentBytes / 2);
    module.wasm.vcp_gpu_forget();
    const again = draw();
    assert.ok(again.rows > 0 && again.rows <= again.begun.poolRows);
    assert.notEqual(module.gpuBegin(1), null, 'the picture can go on');
});

await check('hostile files: the lines of the program, no trap, no growth', async () => {
    let module = await Module.load(wasm), refused = 0, opened = 0, drawn = 0, imaged = 0, jpegs = 0, traps = [], other = [], most = 0, i = 0;
    for (const { content, line } of hostileFiles()) {
        let said;
        try {
            const used = useHostile(module, content);
            said = used.said;
            drawn += used.isDrawn ? 1 : 0;
            imaged += used.tiles > 0 ? 1 : 0;
            jpegs += used.decoded;
        } catch (error) {
            traps.push(`${i}: ${error.message}`);
            module = await Module.load(wasm);
        }
        most = Math.max(most, module.memoryBytes());
        if (said === '') ++opened;
        else if (said !== undefined) {
            ++refused;
            assert.ok(!said.includes('\n') && said.length > 0);
        }
        // The processor draws fewer files than the reader reads.
        if (line !== '' && said !== undefined && said !== line) other.push(`${i}: ${said} instead of ${line}`);
        ++i;
    }
    console.log(`   ${i} files: ${opened} opened, ${drawn} drawn, ${imaged} with images, and ${jpegs} JPEGs; ${refused} refused; at most ${most} ` +
        'bytes of memory');
    assert.ok(drawn > 100 && refused > 100 && imaged > 50 && jpegs > 50);
    assert.deepEqual(traps, []);
    assert.deepEqual(other, []);
    assert.ok(most < 64 << 20);
});

console.log(`${checks} checks passed`);
