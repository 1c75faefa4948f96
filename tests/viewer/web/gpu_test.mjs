// Pictures of WebGL beside those of the processor: gpu_test.mjs chromium|firefox FOLDER PICTURES [rays]. Headless Chromium
// has SwiftShader, and Firefox Mesa's llvmpipe where there is a display, as `xvfb-run -a` makes one. FOLDER: as `vcp publish` makes it, with any scans scan*.vcp and, for the page, plain.vcp. rays: a million rays a
// view, also with a section, and no page.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import http from 'node:http';
import path from 'node:path';
import { Browser } from './browser.mjs';
import { Firefox } from './firefox.mjs';
import { compareColours, compareDepth } from './native_picture.mjs';

const [browserName, folder, pictures, kind] = process.argv.slice(2);
const kSize = kind === 'rays' ? [1000, 1000] : [320, 200];
const kTypes = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm' };
const server = http.createServer((request, answer) => {
    const name = new URL(request.url, 'http://here').pathname.slice(1) || 'index.html', file = path.join(folder, name);
    if (!fs.existsSync(file)) return answer.writeHead(name === 'favicon.ico' ? 204 : 404).end();
    const headers = { 'Content-Type': kTypes[path.extname(name)] ?? 'application/octet-stream' }, content = fs.readFileSync(file);
    const range = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? '');
    if (!range) return answer.writeHead(200, headers).end(content);
    const part = content.subarray(Number(range[1]), Number(range[2]) + 1);
    answer.writeHead(206, { ...headers, 'Content-Range': `bytes ${range[1]}-${Number(range[1]) + part.length - 1}/${content.length}` }).end(part);
}).listen(0, '127.0.0.1');
await new Promise(done => server.once('listening', done));
const address = `http://127.0.0.1:${server.address().port}/`;

const profile = path.join(pictures, 'profile'), browser = browserName === 'firefox' ? new Firefox(profile) : new Browser(profile, { gpu: true });
process.on('exit', () => browser.process.kill('SIGKILL'));
const page = await browser.page(320, 200, false);

/// What the page does: draws a view both ways. `compare(file, views)` returns of each view what both saw.
const kHarness = `
    const [{ Module }, { Gpu }, { Orbit, kFieldOfView }] = await Promise.all(['module', 'gpu', 'camera'].map(x => import('./' + x + '.js')));
    const wasm = await (await fetch('vcp.wasm')).arrayBuffer(), gpu = Gpu.create(true);
    const size = { width: ${kSize[0]}, height: ${kSize[1]} };
    async function opened(file) {
        const bytes = new Uint8Array(await (await fetch(file)).arrayBuffer()), module = await Module.load(wasm);
        module.begin(bytes.length, file, 256 << 20);
        module.supply(0, bytes.subarray(0, 64 << 10));
        while (!module.open()) supplyMissing({ module, bytes });
        return { module, bytes };
    }
    function supplyMissing({ module, bytes }) {
        for (const run of module.missing()) module.supply(run.offset, bytes.subarray(run.offset, run.offset + run.bytes));
    }
    function cast(module, sample) {
        const begun = module.beginSample(sample), depth = new Float32Array(size.width * size.height);
        const pixels = new Uint8ClampedArray(4 * depth.length);
        for (let band = 0; band < begun.bands; ++band) {
            const at = band * begun.rows * size.width;
            pixels.set(module.castBands(size, begun.rows, band, 1, true).pixels, 4 * at);
            depth.set(module.depth(Math.min(size.width * begun.rows, depth.length - at)), at);
        }
        if (sample === 0) module.endSample(begun);
        return { pixels, depth };
    }
    async function texelsOf({ bytes, width, height }) {
        const image = await createImageBitmap(new Blob([bytes], { type: 'image/jpeg' }), { colorSpaceConversion: 'none' });
        const context = new OffscreenCanvas(width, height).getContext('2d', { willReadFrequently: true });
        context.drawImage(image, 0, 0);
        return context.getImageData(0, 0, width, height).data;
    }
    async function settle(scan) {
        const { module } = scan;
        for (let round = 0; round < 2000; ++round) {
            const update = module.update();
            if (update.problem) throw new Error(update.problem);
            if (update.drawable && update.awaitsRays) cast(module, 0);
            if (update.settled) return;
            for (const jpeg of module.jpegs()) module.putJpeg(jpeg.id, await texelsOf(jpeg));
            supplyMissing(scan);
        }
        throw new Error('it does not settle');
    }
    /// Of the first picture that is listened to, while pages are missing: how many rays of the grid hit something as the
    /// processor says it, and how many of these hit another page by WebGL.
    async function heard(scan, view) {
        const { module } = scan;
        for (let round = 0; round < 50; ++round) {
            const update = module.update();
            if (update.drawable && module.beginSample(0).listens) {
                cast(module, 0);
                const said = module.said(), before = 3 + said[0] + said[1], { grid } = await drawn(module, view, 0);
                const table = module.wordsAt(module.wasm.vcp_gpu_table(), 12 * Math.max(...grid.filter((_, i) => i % 4 === 3)));
                const others = Array.from({ length: said[2] }, (_, i) => said.subarray(before + 6 * i, before + 6 * i + 6)).filter(hit =>
                    grid[4 * hit[4] + 3] === 0 || table[12 * (grid[4 * hit[4] + 3] - 1) + 10] !== hit[0]);
                return { hits: said[2], others: others.length };
            }
            if (update.awaitsRays) cast(module, 0);
            supplyMissing(scan);
        }
        return { hits: 0, others: 0 };
    }
    function textOf(bytes) {
        const parts = [];
        for (let i = 0; i < bytes.length; i += 4096) parts.push(String.fromCharCode(...bytes.subarray(i, i + 4096)));
        return btoa(parts.join(''));
    }
    async function drawn(module, view, sample) {
        while (!gpu.isReady(module, module.gpuKind())) await new Promise(done => setTimeout(done, 20));
        const done = gpu.draw(module, size, sample, true), canvas = new OffscreenCanvas(size.width, size.height);
        if (!done) throw new Error('WebGL draws nothing: ' + gpu.gl.getError());
        const context = canvas.getContext('2d');
        context.drawImage(done.picture, 0, 0);
        const pixels = context.getImageData(0, 0, size.width, size.height).data, { cell } = module.info();
        const depth = gpu.rowsShown(0, size.height).depth.map(x => Math.abs(x) > 1e38 ? Infinity : Math.abs(x) * cell);
        return { pixels, depth, grid: done.grid };
    }
    window.compare = async (file, views) => {
        const scan = await opened(file), { module } = scan, seen = [];
        let rays = null;
        for (const { samples = 1, ...more } of views) {
            const orbit = new Orbit(), { boundsMin, boundsMax } = module.info();
            if (more.camera) orbit.fromText(more.camera);
            else orbit.fit(boundsMin, boundsMax, size.width / size.height);
            if (more.cut) more.section = { normal: [-1, 0, 0], offset: -0.5 * (boundsMin[0] + boundsMax[0]) };
            if (more.nearer) orbit.zoom(more.nearer, 0.1, 0.1);
            const view = { ...size, eye: orbit.eye(), ...orbit.axes(), fov: kFieldOfView, top: [0.2, 0.4, 0.6], bottom: [0.9, 0.8, 0.7], ...more };
            module.look(view);
            rays ??= await heard(scan, view);
            await settle(scan);
            let theirs, ours;
            for (let sample = 0; sample < samples; ++sample) theirs = cast(module, sample);
            for (let sample = 0; sample < samples; ++sample) ours = await drawn(module, view, sample);
            seen.push([ours, theirs].map(({ pixels, depth }) => ({ pixels: textOf(pixels), depth: textOf(new Uint8Array(depth.buffer)) })));
        }
        return { seen, rays, cell: module.info().cell };
    };
    window.isThere = true;`;
const unpacked = text => { const bytes = Buffer.from(text, 'base64'); return new Uint8Array(bytes).buffer; };

async function compare(file, views, tolerance) {
    const { seen, rays, cell } = await page.evaluate(`compare('${file}', ${JSON.stringify(Object.values(views))})`);
    console.log(`${file}: of ${rays.hits} rays that the policy hears of, ${rays.others} hit other pages`);
    assert.ok(rays.hits > 20 && rays.others <= rays.hits / 50);
    return Object.keys(views).map((name, i) => {
        const [ours, theirs] = seen[i].map(({ pixels, depth }) => ({
            pixels: new Uint8ClampedArray(unpacked(pixels)), depth: new Float32Array(unpacked(depth)),
        }));
        const depths = compareDepth(ours.depth, theirs.depth, 1e-3 * cell), colours = compareColours(ours.pixels, theirs.pixels, tolerance);
        const holes = ours.depth.reduce((sum, x, k) => sum + (!Number.isFinite(x) && Number.isFinite(theirs.depth[k]) ? 1 : 0), 0);
        return { name, ...depths, holes, colours };
    });
}

await page.go(address);
await page.until('document.readyState === "complete"');
await page.evaluate(`document.body.replaceChildren(); (async () => { ${kHarness} })().catch(error => { window.harnessError = error.stack; })`);
await page.until('Boolean(window.isThere || window.harnessError)');
assert.equal(await page.evaluate('window.harnessError ?? null'), null);

const kClose = '1.6,0.2,0.8,1.6,0.2,0.3';
const kRays = { whole: {}, half: { nearer: 0.5 }, close: { nearer: 0.1 }, cut: { cut: true } };
const kViews = kind === 'rays' ? kRays : {
    whole: {}, close: { camera: kClose }, 'eight samples': { samples: 8 }, studio: { environment: 1 },
    'shadows and occlusion': { shadows: true, occlusionRays: 8 }, 'light of samples': { camera: kClose, shadows: true, samples: 4 },
};
for (const file of fs.readdirSync(folder).filter(name => /^scan.*\.vcp$/.test(name)))
    for (const { name, differ, hits, holes, colours } of await compare(file, kViews, 2)) {
        console.log(`${file}, ${name}: ${differ} of ${hits} hits differ beyond 1e-3 cell, ${holes} holes; ${colours.differ} pixels by more ` +
            `than 2 of 255, at most by ${colours.most}`);
        assert.ok(hits > 3000 && differ <= hits / 1000 && holes <= 2);
        assert.ok(colours.differ <= colours.counted / 1000);
    }
assert.deepEqual(await page.complaints(), []);

/// The page draws by WebGL once it can, and by the processor where WebGL's context is lost, or the browser's own process
/// for graphics.
async function loses() {
    fs.writeFileSync(path.join(folder, 'webgl.html'), `<!doctype html><style>html, body, vcp-viewer { margin: 0; height: 100%; display: block }</style>
        <script type="module" src="vcp-viewer.js"></script><script>window.seen = [];
        addEventListener('progress', event => seen.push(event.detail)); addEventListener('settled', () => { window.settled = true; });
        addEventListener('error', event => { if (event.detail?.message) window.problem = event.detail.message; });</script>
        <vcp-viewer src="plain.vcp" draw="webgl" workers="1"></vcp-viewer>`);
    const page = await browser.page(...kSize, false), isGpus = `window.seen?.at(-1)?.drawnBy === 'webgl' && seen.at(-1).samples === 8`;
    await page.go(`${address}webgl.html`);
    await page.until(isGpus, 300e3);
    assert.equal(await page.evaluate('seen[0].drawnBy'), 'processor', 'nobody waits for WebGL');
    const shown = async () => new Uint8ClampedArray(unpacked(await page.evaluate(`(() => {
        const canvas = document.querySelector('vcp-viewer').shadowRoot.querySelector('canvas');
        const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
        return btoa(Array.from(data, x => String.fromCharCode(x)).join(''));
    })()`)));
    const before = await shown();
    assert.equal(before.length, 4 * kSize[0] * kSize[1]);
    const losses = browserName === 'firefox' ? [] : [() => page.loseContexts(), () => browser.call('Browser.crashGpuProcess').catch(() => {})];
    for (const lose of losses) {
        await page.evaluate('seen = []');
        await Promise.race([lose(), new Promise(done => setTimeout(done, 2000))]);
        await page.evaluate(`document.querySelector('vcp-viewer').fit()`);
        // WebGL may be back before anyone looks.
        await page.until(`seen.some(picture => picture.drawnBy === 'processor' && picture.samples === 8)`, 200e3);
        // The canvas of the page may have been lost as well.
        let differ = before.length;
        for (const end = Date.now() + 30e3; differ > before.length / 4000 && Date.now() < end;) {
            await new Promise(done => setTimeout(done, 200));
            differ = compareColours(await shown(), before, 2).differ;
        }
        assert.ok(differ <= before.length / 4000, `${differ} pixels differ once the processor draws again`);
    }
    assert.equal(await page.evaluate('window.problem ?? null'), null);
    assert.deepEqual(await page.complaints(), []);
}
if (kind !== 'rays') await loses();
await browser.close();
server.close();
