// A published page in a headless browser: page_test.mjs chromium|firefox VCP FOLDER PICTURES [images|package|shards|short]
// FOLDER: as `vcp publish` makes it. PICTURES: folder for what is seen. images: the scan is textured_scene.mjs', without
// loss, and the folder has it with JPEGs as well, as jpeg.vcp; what concerns images is tested. shards: the scan is in shards,
// and the folder has it as the one file as well, as whole.vcp. package: the viewer is in node_modules. short: what browsers
// may do otherwise.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import fs from 'node:fs';
import http from 'node:http';
import net from 'node:net';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import zlib from 'node:zlib';
import { Browser } from './browser.mjs';
import { Firefox } from './firefox.mjs';
import { compareColours, compareDepth, readDepth, readPicture } from './native_picture.mjs';

const [browserName, vcp, folder, pictures, kind] = process.argv.slice(2);
// Read as a module whatever the nearest package.json says.
const viewerFolder = path.join(folder, kind === 'package' ? 'node_modules/vcp-viewer' : '.');
fs.copyFileSync(path.join(viewerFolder, 'camera.js'), path.join(pictures, 'camera.mjs'));
const { Orbit, kFieldOfView } = await import(pathToFileURL(path.resolve(pictures, 'camera.mjs')));

const kTypes = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm' };
const kLead = 64 << 10; // bytes of the viewer's first request
const scan = fs.readFileSync(path.join(folder, 'scan.vcp'));
const kFromEnd = 300; // a byte so far from the end of a file with images is one of its last tile

/// The server, what it does wrong with the scan, and what it was asked for.
let wrong = '', asked = nothingAsked();
function nothingAsked() {
    return { scan: 0, bytes: 0, ranges: [], missing: [], methods: new Set() };
}
function serve(request, answer) {
    const name = new URL(request.url, 'http://here').pathname.slice(1) || 'index.html', file = path.join(folder, name);
    asked.methods.add(request.method);
    if (!fs.existsSync(file) || (name === 'scan.vcp' && wrong === 'missing')) {
        asked.missing.push(name);
        return answer.writeHead(404).end();
    }
    const headers = { 'Content-Type': kTypes[path.extname(name)] ?? 'application/octet-stream', 'Cache-Control': 'no-store' };
    const content = name === 'scan.vcp' ? scan : fs.readFileSync(file);
    if (!name.endsWith('.vcp')) return answer.writeHead(200, headers).end(content);
    ++asked.scan;
    if (wrong === 'down' || (wrong === 'gone' && asked.scan > 2)) return request.socket.destroy();
    const range = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? '');
    if (!range || wrong === 'ranges') return answer.writeHead(200, headers).end(content);
    const first = Number(range[1]), part = Buffer.from(content.subarray(first, Number(range[2]) + 1));
    headers['Content-Range'] = `bytes ${first}-${first + part.length - 1}/${content.length}`;
    const damaged = content.length - kFromEnd - first;
    if (wrong === 'tile' && damaged >= 0 && damaged < part.length) part[damaged] ^= 1;
    asked.ranges.push({ first, end: first + part.length });
    headers.ETag = wrong === 'replaced' && asked.scan > 1 ? '"b"' : '"a"';
    if (request.headers.origin)
        Object.assign(headers, { 'Access-Control-Allow-Origin': '*', 'Access-Control-Expose-Headers': 'Content-Range' });
    asked.bytes += part.length;
    if (wrong === 'gzip') return answer.writeHead(206, { ...headers, 'Content-Encoding': 'gzip' }).end(zlib.gzipSync(part));
    answer.writeHead(206, headers).end(part);
}
async function started() {
    const server = http.createServer(serve).listen(0, '127.0.0.1');
    server.keepAliveTimeout = 0; // what a busy browser leaves idle stays open
    await new Promise(done => server.once('listening', done));
    return `http://127.0.0.1:${server.address().port}/`;
}
const address = await started();

/// The page may be edited: it writes down what it hears.
const kHears = `<script>window.state = { picks: [] };
    addEventListener('progress', event => { state.last = event.detail; state.first ??= event.detail; });
    addEventListener('settled', event => { state.settled = event.detail; });
    addEventListener('pick', event => state.picks.push(event.detail));
    addEventListener('error', event => { if (event.detail?.message) state.problem = event.detail.message; });
    addEventListener('DOMContentLoaded', () => {
        window.viewer = document.querySelector('vcp-viewer');
        window.part = name => viewer.shadowRoot.querySelector(name);
    });</script>`;
const pageFile = path.join(folder, 'index.html'), published = fs.readFileSync(pageFile, 'utf8');
if (!published.includes(kHears)) fs.writeFileSync(pageFile, published.replace('<script', `${kHears}\n<script`));

const browser = new { chromium: Browser, firefox: Firefox }[browserName](path.join(pictures, 'profile'));
process.on('exit', () => browser.process.kill('SIGKILL'));
await browser.connect?.().catch(error => {
    console.log(`${error.message}: skipped`);
    process.exit(77);
});

/// Opens the page and waits until it has settled or shows a problem.
async function open(width, height, { fault = '', link = '', touch = false, site = address } = {}) {
    wrong = fault;
    asked = nothingAsked();
    const page = await browser.page(width, height, touch);
    await page.go(site + link);
    await page.until(`location.href.startsWith('${site}') && innerWidth === ${width} && innerHeight === ${height}`);
    await settle(page);
    return page;
}
async function settle(page) {
    await page.until('Boolean(window.state?.settled || window.state?.problem)');
}
/// Does what an expression says, and waits until the view has settled after it.
async function change(page, expression) {
    await page.evaluate(`state.settled = state.problem = null; ${expression}`);
    await settle(page);
}
/// Waits until the view stands still and has settled: no movement is still to come to rest.
async function rest(page) {
    await change(page, 'clearTimeout(viewer.resting); viewer.look(false)');
}
/// Does what an expression says until another one is true.
async function changeUntil(page, isSo, expression) {
    for (const end = Date.now() + 240e3; !await page.evaluate(isSo); await change(page, expression)) assert.ok(Date.now() < end, isSo);
}
/// A page of the good server: it did what it had to, and its console is empty.
async function closeGood(page) {
    assert.equal(await page.evaluate('state.problem ?? null'), null);
    assert.deepEqual(await page.complaints(), []);
    assert.deepEqual(asked.missing, [], 'nothing is asked for that is not there');
    assert.deepEqual([...asked.methods], ['GET'], 'nothing is asked beforehand');
    await page.close();
}
const shown = page => page.evaluate(`part('canvas').toDataURL()`);
const status = page => page.evaluate(`part('.status').textContent`);

/// What the page needs for its first picture and until it rests, and that it all fits in.
async function looks(width, height, touch) {
    const page = await open(width, height, { touch });
    const { first, last } = await page.evaluate('({ first: state.first, last: state.last })');
    console.log(`${width} x ${height}: first picture ${first.requests} requests, ${first.bytes} bytes; settled ${asked.scan} ` +
        `requests, ${asked.bytes} bytes of ${scan.length}; ${last.memoryBytes} bytes of memory`);
    assert.ok(first.requests <= 3 && first.bytes <= 400e3);
    assert.equal(last.requests, asked.scan);
    assert.equal(last.bytes, asked.bytes);
    assert.ok(last.errorPixels <= 0.5 && last.samples === 8);
    assert.equal(last.drawnBy, 'processor', 'what only stands in for a GPU is left alone');
    assert.ok(asked.bytes <= scan.length, 'nothing is fetched twice');
    if (scan.length <= kLead) assert.deepEqual([asked.scan, asked.bytes], [1, scan.length], 'a small scan is fetched once');
    await page.picture(path.join(pictures, `page_${width}.png`));
    await page.evaluate(`part('[data-do="more"]').click()`);
    // Nothing lies outside of the page.
    const outside = await page.evaluate(`[...viewer.shadowRoot.querySelectorAll('.bar > *, .panel, .scale')].filter(x => {
        const box = x.getBoundingClientRect();
        return box.left < 0 || box.top < 0 || box.right > ${width} || box.bottom > ${height};
    }).map(x => x.className || x.textContent)`);
    assert.deepEqual(outside, []);
    await page.picture(path.join(pictures, `panel_${width}.png`));
    await closeGood(page);
}

/// Light, shadows, sections and modes change the picture, and the controls follow.
async function lights() {
    const page = await open(320, 200);
    let before = await shown(page);
    for (const [name, value] of [['light', '60,20'], ['shadows', ''], ['occlusion', ''], ['section', '-x,0.5'], ['environment', 'studio'],
        ['mode', 'clay']]) {
        await change(page, `viewer.setAttribute('${name}', '${value}')`);
        const now = await shown(page);
        assert.notEqual(now, before, name);
        before = now;
    }
    await page.evaluate(`part('[data-do="more"]').click()`);
    assert.deepEqual(await page.evaluate(`['side', 'above', 'axis', 'place'].map(x => part('[data-set="' + x + '"]').value)`),
        ['60', '20', '-x', '50']);
    await closeGood(page);
}

/// Opens a scan that so many workers cast.
async function openShared(workers, file) {
    const page = await open(kSharedWidth, 200);
    await change(page, `viewer.setAttribute('workers', ${workers}); viewer.src = '${file}?${workers}'; viewer.info = null`);
    // The others take part from the second picture on.
    await page.until(`viewer.info !== null`);
    await changeUntil(page, `state.last.workers >= ${workers}`, 'viewer.look(false)');
    assert.equal(await page.evaluate('state.last.workers'), workers);
    return page;
}
const kSharedWidth = 160; // bands lie above each other, so this may be small

/// The picture does not depend on how many workers cast it, nor does what is fetched. `many`: in all ways to look.
async function shares(many) {
    const kinds = !many ? [''] : ['', `viewer.setAttribute('shadows', '')`, `viewer.setAttribute('occlusion', '')`,
        `viewer.setAttribute('section', '-x,0.5')`, `viewer.setAttribute('mode', 'level')`];
    const pictures = [];
    for (const workers of [1, 3]) {
        const page = await openShared(workers, 'scan.vcp'), seen = [];
        for (const kind of kinds) {
            await change(page, `${kind}; viewer.camera = '${kCameras.close.join(',')}'`);
            seen.push(await shown(page));
            await change(page, 'viewer.fit()');
            seen.push(await shown(page));
        }
        pictures.push(seen);
        await closeGood(page);
    }
    // One that ends while it casts is done without.
    const page = await open(kSharedWidth, 200);
    await change(page, `viewer.setAttribute('workers', 2); viewer.src = 'scan.vcp?lost'`);
    await changeUntil(page, 'state.last.workers === 2', 'viewer.look(false)');
    await change(page, `viewer.camera = '${kCameras.close.join(',')}'; clearTimeout(viewer.resting); viewer.look(false);
        viewer.casters[0].terminate(); viewer.casters[0].onerror(new Event('error'))`);
    assert.equal(await page.evaluate('state.last.workers'), 1);
    assert.equal(await shown(page), pictures[0][0]);
    await closeGood(page);
    for (const other of pictures.slice(1)) other.forEach((picture, i) => assert.equal(picture, pictures[0][i], kinds[i >> 1]));
    assert.equal(new Set(pictures[0]).size, pictures[0].length, 'each shows something else');
}

/// What the program sees from an orbit's camera. Returns depths, and the path of the picture.
function nativeView(name, orbit, width, height, more = [], file = 'scan.vcp') {
    const path_ = end => path.join(pictures, `${name}.${end}`);
    const camera = { position: orbit.eye(), target: orbit.target, fov_degrees: kFieldOfView * 180 / Math.PI };
    fs.writeFileSync(path_('json'), JSON.stringify(camera));
    execFileSync(vcp, ['render', path.join(folder, file), '--device', 'host', '--camera', path_('json'), '--size', `${width}x${height}`,
        '--depth', path_('pfm'), '-o', path_('png'), '--overwrite', '--progress', 'none', ...more]);
    return { depth: readDepth(path_('pfm'), width, height), picture: path_('png') };
}

/// The colours of images are those of the program: without loss the same, and JPEGs as near as browsers' decoders are
/// to libjpeg. The first picture does not wait for them, and nothing is fetched twice.
async function sharpens() {
    const page = await open(kImageSize[0], kImageSize[1]);
    await page.evaluate(`addEventListener('progress', () => { state.shown ??= part('canvas').toDataURL(); });
        viewer.setAttribute('mode', 'unlit'); viewer.setAttribute('budget', 64);`);
    for (const [file, tolerance] of [['scan.vcp', 1], ['jpeg.vcp', 4]]) {
        asked = nothingAsked();
        await change(page, `viewer.src = '${file}?anew'; viewer.info = state.first = state.shown = null`);
        await page.until('viewer.info !== null && Boolean(state.settled)');
        const first = await page.evaluate('state.first');
        assert.ok(first.requests <= 4 && first.bytes <= 400e3, `${first.requests} requests, ${first.bytes} bytes`);
        assert.notEqual(await page.evaluate('state.shown'), await shown(page), 'images come later');
        for (const [name, camera] of Object.entries(kImageCameras)) {
            await change(page, `viewer.camera = '${camera.join(',')}'`);
            await looksNative(page, name, camera, file, tolerance);
        }
        const ranges = asked.ranges.sort((a, b) => a.first - b.first);
        ranges.slice(1).forEach((one, i) => assert.ok(ranges[i].end <= one.first, `byte ${one.first} is fetched twice`));
        console.log(`${file}: first picture ${first.requests} requests, ${first.bytes} bytes; ${asked.scan} requests, ${asked.bytes} bytes`);
    }
    await closeGood(page);
}
async function looksNative(page, name, camera, file, tolerance) {
    const orbit = new Orbit(), [width, height] = kImageSize;
    assert.ok(orbit.fromText(camera.join(',')));
    const { depth, picture } = nativeView(`${file}_${name}`, orbit, width, height, ['--samples', '8', '--shading', 'unlit'], file);
    const isInside = i => [-1, 0, 1].every(dx => [-1, 0, 1].every(dy => Number.isFinite(depth[i + dx + dy * width])));
    const ours = Buffer.from(await page.evaluate(`btoa(Array.from(part('canvas').getContext('2d')
        .getImageData(0, 0, ${width}, ${height}).data, x => String.fromCharCode(x)).join(''))`), 'base64');
    const { differ, counted, mean, most } = compareColours(ours, readPicture(picture), tolerance, isInside);
    console.log(`${file}, ${name}: ${differ} of ${counted} pixels differ by more than ${tolerance} of 255; ${mean.toFixed(3)} in the mean, ` +
        `at most ${most}`);
    assert.ok(counted > 10000 && differ <= counted / 1000);
}
const kImageSize = [320, 200], kImageCameras = { whole: [2, 0.5, 1.5, 6, 0.1, 0.4], close: [1.6, 0.2, 0.8, 1.6, 0.2, 0.3] };
/// Images are the same whoever casts.
async function sharesImages() {
    const seen = [];
    for (const workers of [1, 3]) {
        const page = await openShared(workers, 'jpeg.vcp');
        for (const camera of Object.values(kImageCameras)) {
            await change(page, `viewer.camera = '${camera.join(',')}'`);
            seen.push(await shown(page));
        }
        assert.equal(await page.evaluate('state.last.workers'), workers);
        await closeGood(page);
    }
    assert.deepEqual(seen.slice(0, 2), seen.slice(2));
    assert.notEqual(seen[0], seen[1]);
}

/// A tile that is damaged is one line in the page, and all else is drawn.
async function missesTile() {
    const page = await open(320, 200, { fault: 'tile' });
    await change(page, `viewer.camera = '${kImageCameras.close.join(',')}'`);
    await page.until('Boolean(state.settled)');
    assert.match(await status(page), /tile \d+.*hash does not match/);
    await page.close();
}

/// A scan in shards is seen as the one file is; of a shard that the server lost one line tells, and the rest is shown.
async function showsShards() {
    const views = [], bytes = [];
    for (const file of ['scan.vcp', 'whole.vcp']) {
        const page = await open(640, 400), seen = [];
        await change(page, `viewer.src = '${file}?anew'; viewer.info = state.first = null`);
        await page.until('viewer.info !== null && Boolean(state.settled)');
        const first = await page.evaluate('state.first');
        assert.ok(first.requests <= 3 && first.bytes <= 400e3, `${first.requests} requests, ${first.bytes} bytes to the first picture`);
        for (const camera of Object.values(kCameras)) {
            await change(page, `viewer.camera = '${camera.join(',')}'`);
            seen.push(await shown(page));
        }
        views.push(seen);
        bytes.push(`${file}: first picture ${first.requests} requests, ${first.bytes} bytes; settled ${await page.evaluate('state.last.requests')} requests, ` +
            `${await page.evaluate('state.last.bytes')} bytes`);
        await closeGood(page);
    }
    console.log(bytes.join('\n'));
    assert.deepEqual(views[0], views[1]);
    assert.notEqual(views[0][0], views[0][1]);
    // The largest shard is none that a first picture needs: that has coarse pages.
    const shards = fs.readdirSync(folder).filter(name => /^[0-9a-f]{32}\.vcp$/.test(name)), size = name => fs.statSync(path.join(folder, name)).size;
    const [lost] = shards.sort((a, b) => size(b) - size(a));
    assert.ok(shards.length >= 4);
    fs.renameSync(path.join(folder, lost), path.join(pictures, 'lost.vcp'));
    const page = await open(640, 400, { link: '?lost' });
    await page.until('Boolean(state.problem)');
    assert.match(await page.evaluate('state.problem'), new RegExp(lost));
    await page.until('Boolean(state.settled)');
    assert.ok((await shown(page)).length > 10000);
    fs.renameSync(path.join(pictures, 'lost.vcp'), path.join(folder, lost));
    await page.close();
}

const kCameras = { whole: [0, 0.86, 0, 8, 0.5, 0.4], close: [0, 1.1, 0, 1.6, 0.3, 0.35] };
/// The depth of each pixel and two measured points, against those of the program; a link leads to the same picture.
async function measures(name, width, height) {
    const page = await open(width, height), orbit = new Orbit(), camera = kCameras[name].join(',');
    assert.ok(orbit.fromText(camera));
    await change(page, `viewer.camera = '${camera}'`);
    const { depth: native } = nativeView(name, orbit, width, height), cell = await page.evaluate('viewer.info.cell'), eye = orbit.eye();
    const ours = await page.evaluate(`Promise.all(Array.from({ length: ${width * height} }, (_, i) =>
        viewer.pick(i % ${width} + 0.5, Math.floor(i / ${width}) + 0.5).then(hit => hit?.depth ?? null)))`);
    const { differ, hits } = compareDepth(ours.map(depth => depth ?? Infinity), native, 1e-3 * cell);
    console.log(`${name}: ${differ} of ${width * height} pixels differ beyond 1e-3 cell; ${hits} hits`);
    assert.ok(hits > 3000 && differ <= width * height / 1000);

    // Two clicks measure what lies under them.
    await page.evaluate(`part('canvas').focus()`);
    await page.key('m');
    const { right, up, forward } = orbit.axes(), half = Math.tan(kFieldOfView / 2);
    const isInside = i => [-1, 0, 1].every(dx => [-1, 0, 1].every(dy => Math.abs(native[i + dx + dy * width] - native[i]) < cell));
    const isFree = i => i > 45 * width && i < 135 * width; // of the line above and the bar below
    const inside = [...native.keys()].filter(i => isFree(i) && isInside(i));
    const places = [0.25, 0.75].map(part => inside[Math.floor(part * inside.length)]).map(i => {
        const x = i % width, y = Math.floor(i / width);
        const across = (x + 0.5 - width / 2) / (height / 2) * half, above = (height / 2 - y - 0.5) / (height / 2) * half;
        const ray = forward.map((to, i) => to + across * right[i] + above * up[i]), scale = native[y * width + x] / Math.hypot(...ray);
        return { x, y, place: eye.map((from, i) => from + scale * ray[i]) };
    });
    for (const [i, { x, y }] of places.entries()) {
        await page.click(x, y);
        await page.until(`state.picks.length === ${i + 1}`);
    }
    const far = (a, b) => Math.hypot(...a.map((x, i) => x - b[i]));
    const picks = await page.evaluate('state.picks'), distance = far(places[0].place, places[1].place);
    for (const [i, { place }] of places.entries()) assert.ok(far(picks[i].position, place) <= 1e-3 * cell, `point ${i + 1}`);
    const [length, error] = (await status(page)).split(' ± ').map(Number);
    assert.ok(error > 0 && error < length / 100);
    assert.ok(Math.abs(length - distance) <= error, `${length} instead of ${distance}`);
    assert.equal(await page.evaluate(`part('svg text').textContent`), await status(page), 'it stands at the line as well');
    await page.picture(path.join(pictures, `measured_${name}.png`));
    await page.key('m');
    assert.equal(await page.evaluate(`part('svg').childElementCount`), 0);

    await page.evaluate(`part('[data-do="link"]').click()`);
    const link = await page.evaluate('location.hash');
    const seen = await shown(page);
    await closeGood(page);
    const other = await open(width, height, { link });
    assert.equal(await other.evaluate('viewer.camera'), orbit.toText());
    assert.equal(await shown(other), seen, 'the link leads to the same picture');
    await closeGood(other);
}

/// Keys, fingers and the mouse move the camera.
async function moves() {
    const camera = page => page.evaluate(`viewer.camera.split(',').map(Number)`);
    let page = await open(390, 844, { touch: true }), before = await camera(page);
    const finger = (x, y) => ({ x, y, id: 0 }), thumb = (x, y) => ({ x, y, id: 1 });
    /// What of the camera has changed, once something has.
    const moved = async () => {
        await page.until(`viewer.camera !== '${before}'`);
        const now = await camera(page), changed = now.map((x, i) => Math.abs(x - before[i]) > 1e-6);
        before = now;
        return { target: changed.slice(0, 3).some(Boolean), distance: changed[3], turned: changed[4] || changed[5] };
    };
    await page.touch([[finger(150, 300)], [finger(200, 300)]]);
    assert.deepEqual(await moved(), { target: false, distance: false, turned: true }, 'one finger turns');
    const distance = before[3];
    await page.touch([[finger(150, 300), thumb(250, 500)], [finger(100, 250), thumb(300, 550)]]);
    assert.deepEqual(await moved(), { target: true, distance: true, turned: false }, 'two fingers zoom and move');
    assert.ok(before[3] < distance);
    // Two taps are one double tap where they come soon: what has no time for that taps again.
    await page.touch([[finger(200, 300)]]);
    assert.deepEqual(await camera(page), before, 'a tap alone does nothing');
    for (const end = Date.now() + 240e3; String(await camera(page)) === String(before);) {
        assert.ok(Date.now() < end, 'a double tap comes nearer');
        await page.touch([[finger(203, 302)]]);
    }
    assert.deepEqual(await moved(), { target: true, distance: true, turned: false }, 'a double tap comes nearer');
    await page.hover(1, 1);
    await rest(page);
    await closeGood(page);

    page = await open(320, 200);
    before = await camera(page);
    await page.evaluate(`part('canvas').focus()`);
    await page.key('ArrowLeft');
    assert.deepEqual(await moved(), { target: false, distance: false, turned: true });
    await page.key('+');
    assert.deepEqual(await moved(), { target: false, distance: true, turned: false });
    await page.wheel(60, 60, -100);
    await page.until(`viewer.camera.split(',')[3] < ${before[3] * 0.99}`);
    assert.deepEqual(await moved(), { target: true, distance: true, turned: false }, 'the wheel zooms to the cursor');
    await page.key('f');
    assert.deepEqual(await moved(), { target: true, distance: true, turned: false });
    // Who has no mouse measures from the middle, and closes with Escape.
    await rest(page);
    await page.key('m');
    await page.key('Enter');
    await page.until('state.picks.length === 1');
    await change(page, 'viewer.orbit.turn(20, 0, 200); viewer.look(false)');
    await page.key('Enter');
    await page.until('state.picks.length === 2');
    assert.match(await status(page), /^[0-9.]+ ± [0-9.]+$/);
    await page.key('Escape');
    assert.deepEqual(await page.evaluate(`[viewer.dataset.tool, part('svg').childElementCount]`), ['', 0]);
    await closeGood(page);
}

/// An element that is taken out and put back, and a link that leads nowhere, show the scan.
async function persists() {
    for (const link of ['#vcp=%E0%A4%A', '#vcp=NaN,0,0,1,0,0', '#vcp=0,0,0,-1,0,0', '#vcp=1e308,1e308,0,1e308,0,0', '#vcp=<svg onload=1>']) {
        const page = await open(160, 100, { link: `?${link.length}${link}` });
        const fitted = await page.evaluate('viewer.camera');
        await page.evaluate('viewer.fit()');
        assert.equal(await page.evaluate('viewer.camera'), fitted, link);
        await rest(page);
        await closeGood(page);
    }
    const page = await open(160, 100), before = await shown(page);
    await change(page, `(async () => {
        for (let i = 0; i < 20; ++i) {
            const hit = viewer.pick(80, 50);
            viewer.remove();
            await hit; // a question that nobody answers any more
            document.body.append(viewer);
            await new Promise(done => setTimeout(done, 20 * (i % 6)));
        }
        state.settled = null;
    })()`);
    assert.equal(await shown(page), before);
    await closeGood(page);
}

/// A view that cannot be drawn is one line, and the next one is drawn; so are elements of any form, and with attributes that
/// say nothing. Without a scan nothing is shown, nor asked for.
async function recovers() {
    const page = await open(160, 100);
    await change(page, 'viewer.orbit.target = [NaN, 0, 0]; viewer.look(false)');
    assert.match(await status(page), /coordinates that are not numbers/);
    await change(page, 'viewer.fit()');
    assert.deepEqual([await status(page), await page.evaluate('state.problem ?? null')], ['', null]);
    await change(page, `viewer.style.height = '40000px'`);
    assert.equal(await page.evaluate('state.last.height'), 16384);
    await change(page, `viewer.style.height = ''`);
    const before = await shown(page);
    await change(page, `viewer.setAttribute('mode', 'constructor')`);
    assert.equal(await shown(page), before);
    for (const budget of ['-5', 'x', '1e300', '0']) {
        await change(page, `viewer.setAttribute('budget', '${budget}'); viewer.src = 'scan.vcp?${budget}'`);
        assert.equal(await shown(page), before, budget);
    }
    await page.evaluate(`viewer.removeAttribute('src')`);
    assert.deepEqual([await status(page), await page.evaluate(`part('.scale').hidden`)], ['', true]);
    const empty = await shown(page);
    await change(page, `viewer.src = 'scan.vcp?again'`);
    assert.equal(await shown(page), before);
    assert.ok(empty.length < before.length / 4);
    await closeGood(page);
}

/// Annotations open and close; what is wrong with their file is one line.
async function annotates() {
    const page = await open(390, 844), notes = [{ position: [0, 0.8, 0], title: 'Here', text: '<b>plain</b>' }];
    const given = file => `viewer.setAttribute('annotations', 'data:application/json,' + encodeURIComponent('${file}'))`;
    await page.evaluate(given(JSON.stringify(notes)));
    await page.until(`part('.note') !== null`);
    await page.evaluate(`part('.note').click()`);
    assert.deepEqual(await page.evaluate(`[part('.card').hidden, part('.card h2').textContent, part('.card p').textContent,
        part('.card b') === null]`), [false, 'Here', '<b>plain</b>', true], 'a text is no markup');
    await page.picture(path.join(pictures, 'note.png'));
    await page.evaluate(`part('.note').focus()`);
    await page.key('Escape');
    assert.equal(await page.evaluate(`part('.card').hidden`), true);
    await page.evaluate(given('[{ "position": [0, 1] }]'));
    await page.until('state.problem');
    assert.match(await status(page), /annotation 1 has no position of three numbers/);
    await page.evaluate(`viewer.removeAttribute('annotations'); state.problem = null`);
    assert.equal(await status(page), '');
    await closeGood(page);
}

/// What consoles complain of is heard, the page's and its workers'.
async function hears() {
    const page = await browser.page(320, 200, false);
    await page.evaluate(`console.error('one'); setTimeout(() => { throw 'two'; });
        new Worker(URL.createObjectURL(new Blob(['setTimeout(() => { console.error("three"); throw "four"; }, 100)'])))`);
    for (const said of ['one', 'two', 'three', 'four']) {
        const isHeard = async () => (await page.complaints()).some(error => error.includes(said));
        for (let i = 0; i < 200 && !await isHeard(); ++i)
            await new Promise(done => setTimeout(done, 50));
        assert.ok(await isHeard(), said);
    }
    await page.close();
}

const kRepeats = { chromium: 2, firefox: 10 }; // what a cut connection did not answer they ask for so often
/// A server that does wrong is one line in the page, and is not asked on and on.
async function complains() {
    const faults = [['ranges', /ignores ranges/, 1], ['missing', /no such file/, 1], ['gzip', /compresses ranges/, 4],
        ['down', /cannot be reached/, 4 * kRepeats[browserName]]];
    if (scan.length > kLead) faults.push(['replaced', /was replaced/, 3]);
    for (const [fault, expected, requests] of faults) {
        const page = await open(320, 200, { fault });
        const said = await status(page);
        assert.match(said, expected, fault);
        assert.ok(!said.includes('\n'));
        assert.ok(asked.scan <= requests, `${fault}: ${asked.scan} requests`);
        await page.close();
    }
}

/// A page written by hand, with the package for npm: it draws, moves and settles, and a module may import the class.
async function packaged() {
    const page = await open(800, 600);
    const { width, height, samples } = await page.evaluate('state.last');
    assert.deepEqual([height, samples], [480, 8]);
    assert.ok(width > 700 && width <= 800);
    const before = await shown(page);
    assert.ok(before.length > 20000);
    await change(page, 'viewer.orbit.turn(100, 0, 480); viewer.moved()');
    assert.notEqual(await shown(page), before);
    assert.ok(await page.evaluate(`import('./node_modules/vcp-viewer/vcp-viewer.js').then(({ VcpViewer }) => viewer instanceof VcpViewer)`));
    await page.picture(path.join(pictures, 'page.png'));
    await closeGood(page);
}

/// The network goes before all has come, and comes back.
async function returns() {
    const page = await open(320, 200, { fault: 'gone' });
    assert.match(await status(page), /cannot be reached/);
    assert.ok(await page.evaluate('Boolean(state.first)'), 'what came is drawn');
    wrong = '';
    await change(page, `dispatchEvent(new Event('online'))`);
    assert.equal(await page.evaluate('state.problem'), null);
    assert.equal(await status(page), '');
    await page.close();
    // So it is where it was not there at first.
    const late = await open(320, 200, { fault: 'down' });
    assert.match(await status(late), /cannot be reached/);
    wrong = '';
    await change(late, `dispatchEvent(new Event('online'))`);
    assert.deepEqual([await status(late), await late.evaluate('viewer.info.triangles > 0')], ['', true]);
    await late.close();
}

/// The scan lies on another server than the page.
async function crosses() {
    const page = await open(320, 200), other = await started();
    await change(page, `viewer.src = '${other}scan.vcp'`);
    assert.ok(await page.evaluate('viewer.info.triangles > 0'));
    await closeGood(page);
}

/// Returns a function that gives numbers of a range: always the same ones.
function randomNumbers() {
    let seed = 1;
    return (low, high) => {
        seed = seed * 16807 % 2147483647;
        return low + seed / 2147483647 * (high - low);
    };
}
const turnedAtRandom = random => `viewer.orbit.turn(${random(-150, 150)}, ${random(-100, 100)}, 200);
    viewer.orbit.zoom(${Math.exp(random(-1.8, 1.5))}, ${random(-0.5, 0.5)}, ${random(-0.5, 0.5)});`;

/// Views at random with less memory than the scan takes: each settles, the budget holds, and memory does not grow.
async function wanders() {
    // Another worker gets a third of the budget.
    const page = await open(320, 200), budget = 2.5 * 2 ** 20;
    await change(page, `viewer.setAttribute('budget', ${1.5 * budget / 2 ** 20}); viewer.setAttribute('workers', 2); viewer.src = 'scan.vcp?anew'; state.most = 0;
        addEventListener('progress', event => {
            state.most = Math.max(state.most, event.detail.residentBytes);
            state.relaxed ||= event.detail.relaxed;
        })`);
    const memory = [], random = randomNumbers();
    for (let i = 0; i < 40; ++i) {
        // A view that is left before its pages have come must not keep the next one from settling.
        for (let moves = random(0, 8); moves > 0; --moves)
            await page.evaluate(`${turnedAtRandom(random)} viewer.moved()`);
        await change(page, i % 8 === 7 ? 'viewer.fit()' : 'viewer.moved()');
        memory.push(await page.evaluate('state.last.memoryBytes'));
    }
    const most = await page.evaluate('state.most');
    console.log(`40 views: at most ${most} bytes of ${budget}; ${memory[19]} bytes of memory after 20, ${memory[39]} after 40`);
    assert.equal(await page.evaluate('state.last.workers'), 2);
    assert.ok(most > 0 && most <= budget && await page.evaluate('state.relaxed'));
    assert.ok(memory[39] <= memory[19] * 1.25);
    await closeGood(page);
}

/// With little memory, pages that came a moment ago stay while the view moves. Views that are left after their first
/// picture keep the next one from nothing, though all bytes are there, so nothing is fetched, and nobody does anything.
async function leaves() {
    const page = await open(320, 200), random = randomNumbers();
    await change(page, `viewer.setAttribute('workers', 1); viewer.setAttribute('budget', 2.5); viewer.src = 'scan.vcp?left'`);
    await page.evaluate(`window.drawn = () => new Promise(done => addEventListener('progress', function drawn(event) {
        if (event.detail.number !== viewer.number) return;
        removeEventListener('progress', drawn);
        done();
    }))`);
    for (let round = 0; round < 30; ++round) {
        let views = '';
        for (let moves = Math.floor(random(0, 8)); moves >= 0; --moves)
            views += `${turnedAtRandom(random)} ${round % 8 === 7 ? 'viewer.fit(); clearTimeout(viewer.resting);' : ''}
                viewer.look(${moves > 0}); ${moves > 0 ? 'await drawn();' : ''}`;
        await change(page, `(async () => { ${views} })()`);
    }
    await closeGood(page);
}

/// The folder as `vcp serve` serves it; the axis that points up; a box is shown as a whole whatever the page's form.
async function serves() {
    const server = spawn(vcp, ['serve', folder, '--port', '0', '--json'], { stdio: ['ignore', 'pipe', 'inherit'] });
    const said = JSON.parse(await new Promise(done => server.stdout.once('data', done)));
    const page = await open(200, 420, { site: said.address });
    const { boundsMin: low, boundsMax: high } = await page.evaluate('viewer.info');
    for (const up of ['y', 'z']) {
        await change(page, `viewer.setAttribute('up', '${up}')`);
        const corners = [...Array(8).keys()].map(i => low.map((x, axis) => (i >> axis & 1 ? high[axis] : x)));
        const seen = await page.evaluate(`${JSON.stringify(corners)}.map(x => viewer.orbit.project(x, 200, 420))`);
        for (const { x, y } of seen) assert.ok(x >= 0 && x <= 200 && y >= 0 && y <= 420, `${up}: ${x}, ${y}`);
        assert.ok(Math.max(...seen.map(p => p.x)) - Math.min(...seen.map(p => p.x)) > 120, 'and fills the page');
        const [foot, top] = await page.evaluate(`[[0, 0, 0], ${up === 'y' ? '[0, 1, 0]' : '[0, 0, 1]'}].map(x => viewer.orbit.project(x, 200, 420))`);
        assert.ok(Math.abs(foot.x - top.x) < 1e-6 + 0.05 * Math.abs(foot.y - top.y) && top.y < foot.y, `${up} points up`);
    }
    await page.close();
    server.kill('SIGINT');
}

/// nginx, told to compress everything: the viewer comes compressed, and ranges of the scan as they are.
async function servesCompressed() {
    const nginx = ['/usr/sbin/nginx', '/usr/bin/nginx'].find(fs.existsSync);
    if (!nginx) return console.log('nginx is missing: left out');
    const port = await new Promise(done => {
        const free = net.createServer().listen(0, '127.0.0.1', () => {
            const { port } = free.address();
            free.close(() => done(port));
        });
    });
    const work = path.resolve(pictures, 'nginx'), file = path.join(work, 'nginx.conf'), types = Object.entries(kTypes);
    fs.mkdirSync(work, { recursive: true });
    fs.writeFileSync(file, `daemon off; pid ${work}/pid; ${process.getuid() === 0 ? 'user root;' : ''}
        events {}
        http {
            access_log ${work}/access.log;
            ${['client_body', 'proxy', 'fastcgi', 'uwsgi', 'scgi'].map(name => `${name}_temp_path ${work}/${name};`).join(' ')}
            types { ${types.map(([ending, type]) => `${type} ${ending.slice(1)};`).join(' ')} }
            gzip on; gzip_types *; gzip_min_length 1;
            server { listen 127.0.0.1:${port}; root ${path.resolve(folder)}; }
        }`);
    const server = spawn(nginx, ['-p', work, '-e', path.join(work, 'error.log'), '-c', file], { stdio: 'inherit' });
    const site = `http://127.0.0.1:${port}/`;
    for (const end = Date.now() + 30e3; !await fetch(site).then(() => true, () => false); await new Promise(done => setTimeout(done, 50)))
        assert.ok(Date.now() < end, 'nginx does not start');
    const seen = [];
    for (const one of [site, address]) {
        const page = await open(320, 200, { site: one });
        seen.push(await shown(page));
        const sizes = await page.evaluate(`performance.getEntriesByType('resource').map(({ name, encodedBodySize, decodedBodySize }) => [name, encodedBodySize, decodedBodySize])`);
        const [, sent, whole] = sizes.find(([name]) => name.endsWith('vcp-viewer.js'));
        assert.equal(sent < whole, one === site);
        assert.equal(await page.evaluate('state.problem ?? null'), null);
        await page.close();
    }
    assert.equal(seen[0], seen[1]);
    server.kill('SIGQUIT');
}

/// Runs a step and says how long it took.
async function step(run, ...all) {
    const began = performance.now();
    await run(...all);
    console.log(`   ${[run.name, ...all].join(' ')}: ${((performance.now() - began) / 1e3).toFixed(1)} s`);
}

if (kind === 'short') {
    await step(looks, 390, 844, true);
    await step(measures, 'whole', 320, 200);
    await step(shares, false);
    for (const run of [moves, persists]) await step(run);
} else if (kind === 'package') {
    await step(packaged);
} else if (kind === 'shards') {
    await step(showsShards);
} else if (kind === 'images') {
    for (const run of [sharpens, sharesImages, missesTile]) await step(run);
} else if (scan.length > 512 << 10) {
    // Of the larger scans, whose pages outnumber a small budget.
    await step(leaves);
    await step(wanders);
} else {
    if (scan.length <= kLead) await step(hears); // whatever the scan
    await step(looks, 1600, 1000, false);
    await step(looks, 390, 844, true);
    await step(complains);
    await step(lights);
    if (scan.length > kLead) {
        for (const name of Object.keys(kCameras)) await step(measures, name, 320, 200);
        await step(shares, true);
        for (const run of [moves, persists, recovers, annotates, returns, crosses, serves, servesCompressed]) await step(run);
    }
}
await browser.close();
console.log('page_test: all checks passed');
process.exit(0);
