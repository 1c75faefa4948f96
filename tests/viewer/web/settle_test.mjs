// The viewer's workers in Node, in a time of their own: thousands of views that are left half-way, answers that come late,
// in any order or never, little memory, workers that end. Each view must settle, with nothing left to fetch, and show
// what it shows in a viewer that saw nothing before. Usage: node settle_test.mjs WEB_FOLDER PAGES SEED SCAN.vcp...
// PAGES pages with a few views each. A failure names its seed, which repeats it.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import { Module, Orbit, Ranges, cast, kFieldOfView, opened, server, settle, wasm } from './module_use.mjs';

const [web, pages, firstSeed, ...scans] = process.argv.slice(2);
const kBudgets = [1.25, 2.5, 6, 32]; // MiB
const kViews = 5; // of a page
const kMostSeconds = 300, kMostEvents = 20000; // until a view has settled: of the time in here, and what happens meanwhile
const kRestEvents = 200; // that may happen once it has

/// What happens, and when. Of what is due, anything may happen next, but things of one source happen in their order.
class World {
    constructor(seed) {
        Object.assign(this, { seed: 1 + seed * 48271 % 2147483646, now: 0, sources: new Map(), events: 0 });
    }
    random(low, high) {
        this.seed = this.seed * 16807 % 2147483647;
        return low + this.seed / 2147483647 * (high - low);
    }
    pick(list) { return list[Math.floor(this.random(0, list.length))]; }
    chance(part) { return this.random(0, 1) < part; }

    after(ms, run, source = Symbol('alone')) {
        if (!this.sources.has(source)) this.sources.set(source, []);
        this.sources.get(source).push({ due: this.now + Math.max(ms, 0), run });
    }
    /// Has one thing happen; false where nothing is to come.
    async step() {
        const next = [...this.sources].map(([source, list]) => ({ source, due: list[0].due }));
        if (next.length === 0) return false;
        this.now = Math.max(this.now, Math.min(...next.map(one => one.due)));
        const { source } = this.pick(next.filter(one => one.due <= this.now)), list = this.sources.get(source);
        const { run } = list.shift();
        if (list.length === 0) this.sources.delete(source);
        ++this.events;
        run();
        await settled();
        return true;
    }
}
const realImmediate = setImmediate, realTimeout = setTimeout;
/// Waits until promises that are kept have been heard.
const settled = () => new Promise(done => realImmediate(done));

let world;
const compiled = await WebAssembly.compile(wasm), { load } = Module, modules = [];
Module.load = async () => {
    modules.push(await load(compiled));
    return modules.at(-1);
};
globalThis.setTimeout = (run, ms = 0) => world.after(ms, run);
const intervals = new Set();
globalThis.setInterval = (run, ms) => {
    const timer = Symbol('interval'), again = () => world.after(ms, () => {
        if (!intervals.has(timer)) return;
        run();
        again();
    }, timer);
    intervals.add(timer);
    again();
    return timer;
};
globalThis.clearInterval = timer => {
    intervals.delete(timer);
    world.sources.delete(timer);
};
Object.defineProperty(performance, 'now', { value: () => world.now });
const castBands = Module.prototype.castBands;
Module.prototype.castBands = function (...all) {
    world.now += world.random(0, world.slowness); // a processor takes its time
    return castBands.apply(this, all);
};
/// While pages come, a view that stands still is drawn half of the time at most.
let drawnSoon = 0;
const { look, update, beginSample, endSample } = Module.prototype;
Object.assign(Module.prototype, {
    look(view) {
        this.number = view.number;
        look.call(this, view);
    },
    update() {
        const updated = update.call(this);
        this.awaitsRays = updated.awaitsRays;
        return updated;
    },
    beginSample(sample) {
        const { number, end, ms } = this.picture ?? {};
        if (sample === 0 && number === this.number && !this.awaitsRays && world.network?.underWay > 0 && world.now < end + ms) ++drawnSoon;
        if (sample === 0) this.beganAt = world.now;
        return beginSample.call(this, sample);
    },
    endSample(begun) {
        endSample.call(this, begun);
        this.picture = { number: this.number, end: world.now, ms: world.now - this.beganAt };
    },
});
/// JPEGs are decoded to this; their headers say how large they are.
const grey = (width, height) => new Uint8ClampedArray(4 * width * height).fill(99);
globalThis.OffscreenCanvas = class {
    getContext() {
        return { drawImage() {}, getImageData: (x, y, width, height) => ({ data: grey(width, height) }) };
    }
};
globalThis.createImageBitmap = async blob => {
    const bytes = new Uint8Array(await blob.arrayBuffer());
    let at = 2;
    while (bytes[at + 1] !== 0xc0 && bytes[at + 1] !== 0xc1) at += 2 + 256 * bytes[at + 2] + bytes[at + 3];
    await new Promise(done => world.after(world.random(0, 200), done));
    return { height: 256 * bytes[at + 5] + bytes[at + 6], width: 256 * bytes[at + 7] + bytes[at + 8], close() {} };
};

/// Two ends of a channel between workers.
function channel() {
    const ends = [{}, {}];
    ends.forEach((end, i) => {
        end.postMessage = (data, transfer = []) => {
            const copy = structuredClone(data, { transfer });
            world.after(world.random(0, 30), () => ends[1 - i].onmessage?.({ data: copy }), end);
        };
    });
    return ends;
}

/// The body of an answer, in two pieces.
function bodyOf(bytes) {
    const pieces = [bytes.subarray(0, bytes.length >> 1), bytes.subarray(bytes.length >> 1)];
    return { getReader: () => ({ read: async () => (pieces.length > 0 ? { value: pieces.shift(), done: false } : { done: true }) }) };
}

/// A server that is slow, and that cannot be reached now and then.
class Network {
    constructor(bytes) {
        Object.assign(this, { bytes, isDown: false, isRefusing: false, underWay: 0, failures: new Map() });
        Object.assign(this, { worst: world.pick([5, 300, 5000]), lost: world.pick([0, 0.3]), silent: world.pick([0, 0.2]) });
    }
    async fetch(url, { headers, signal } = {}) {
        if (!headers) return new Response(wasm);
        const [first, last] = /bytes=(\d+)-(\d+)/.exec(headers.Range).slice(1).map(Number);
        const part = this.bytes.subarray(first, last + 1);
        // What fails for a moment is tried four times. Some connections are lost, and nobody says so.
        const failures = this.failures.get(first) ?? 0, mayFail = failures < 3;
        const isSilent = mayFail && world.chance(this.silent), isLost = isSilent || (mayFail && world.chance(this.lost));
        this.failures.set(first, isLost ? failures + 1 : 0);
        ++this.underWay;
        await new Promise(done => (isSilent ? signal.addEventListener('abort', done) : world.after(world.random(0, this.worst), done)));
        --this.underWay;
        if (isLost || this.isDown) throw new TypeError('failed');
        if (this.isRefusing) return { status: 403 };
        const range = `bytes ${first}-${first + part.length - 1}/${this.bytes.length}`;
        return { status: 206, headers: new Map([['Content-Range', range]]), body: bodyOf(part) };
    }
}

/// What the page does, as far as workers hear of it.
class Page {
    static async open(network, budgetBytes, workers) {
        const page = Object.assign(new Page(), { network, budgetBytes, number: 0, asked: 0, starts: [], orbit: new Orbit() });
        globalThis.fetch = (...all) => network.fetch(...all);
        const begun = async (name, self) => {
            globalThis.self = self;
            await import(`${pathToFileURL(path.join(web, name))}?${Math.random()}`);
        };
        for (let i = 0; i < workers; ++i) {
            const self = {};
            await begun('caster.js', self);
            page.starts.push(self);
        }
        page.worker = { postMessage: (data, transfer = []) => {
            const copy = structuredClone(data, { transfer });
            world.after(world.random(0, 5), () => page.hear(copy), page.worker);
        } };
        await begun('worker.js', page.worker);
        page.send({ type: 'open', url: 'http://here/scan.vcp', wasm: 'http://here/vcp.wasm', budgetBytes, draw: 'processor' });
        await page.until(() => page.info);
        page.starts.forEach((self, number) => {
            const [port1, port2] = channel();
            page.send({ type: 'caster', number, port: port2, shareBytes: budgetBytes / 4 });
            self.onmessage({ data: { port: port1, ...page.start } });
        });
        page.orbit.fit(page.info.boundsMin, page.info.boundsMax, 1.6);
        return page;
    }
    send(data) {
        world.after(world.random(0, 5), () => this.worker.onmessage({ data }), this);
    }
    hear(data) {
        if (data.type === 'opened') [this.info, this.start] = [data.info, data.start];
        else if (data.type === 'picture') {
            this.drawn = data.number;
            this.workers = Math.max(this.workers ?? 0, data.workers);
            assert.ok(data.update.residentBytes <= this.budgetBytes, 'the budget holds');
        } else if (data.type === 'picked') --this.asked, this.hit = data.hit;
        else if (data.type === 'error') this.problem = data.message;
        else if (data.type === 'problem') assert.fail(data.message);
        else if (data.number === this.number) this.settled = data.update;
    }
    /// Lets things happen until something is so.
    async until(isSo) {
        const { now, events } = world;
        while (!isSo()) {
            const isLate = world.now > now + 1e3 * kMostSeconds || world.events > events + kMostEvents;
            if (!isLate && await world.step()) continue;
            // Modules are compiled in the time of the machine.
            for (let i = 0; !this.info && i < 1e4 && world.sources.size === 0; ++i) await new Promise(done => realTimeout(done, 1));
            if (isLate || world.sources.size === 0)
                assert.fail(`never: ${isSo}, ${((world.now - now) / 1e3).toFixed(1)} s and ${world.events - events} events later; ` +
                    `${this.network.underWay} requests under way; ${JSON.stringify(this.view)}`);
        }
    }
    look(moving) {
        const { up, forward } = this.orbit.axes();
        const [width, height] = moving ? [16, 10] : world.pick([[48, 30], [48, 30], [64, 70]]);
        this.settled = null;
        this.view = {
            type: 'look', number: ++this.number, moving, width, height, eye: this.orbit.eye(), forward, up, fov: kFieldOfView,
            errorPixels: moving ? 1 : world.fine, mode: world.mode, occlusionRays: moving ? 0 : world.occlusion, shadows: world.occlusion > 0,
        };
        this.send(this.view);
    }
    turn() {
        this.orbit.turn(world.random(-150, 150), world.random(-100, 100), 200);
        this.orbit.zoom(Math.exp(world.random(-1.8, 1.5)), world.random(-0.5, 0.5), world.random(-0.5, 0.5));
    }
    ask(x, y) {
        ++this.asked;
        this.send({ type: 'pick', id: 0, x, y });
    }
    async hitAt(x, y) {
        this.ask(x, y);
        await this.until(() => this.asked === 0);
        return this.hit;
    }
    /// Waits so long, while other things happen.
    async wait(ms) {
        let isOver = false;
        world.after(ms, () => { isOver = true; });
        await this.until(() => isOver);
    }
}

/// Goes on to another view, in one of the ways of people and machines.
async function goOn(page) {
    const { network } = page, kind = world.random(0, 1);
    world.mode = world.chance(0.1) ? 7 : 0;
    world.occlusion = world.chance(0.1) ? 2 : 0;
    world.fine = world.pick([0.5, 0.1, 0.02]);
    if (kind < 0.1) page.send({ type: 'hide', hidden: true });
    else if (kind < 0.5) network[world.pick(['isDown', 'isRefusing'])] = true;
    for (let moves = Math.floor(world.random(0, 6)); moves > 0; --moves) {
        page.turn();
        page.look(true);
        await page.wait(world.random(0, world.pick([5, 60, 900])));
    }
    if (world.chance(0.1)) page.orbit.fit(page.info.boundsMin, page.info.boundsMax, 1.6);
    else page.turn();
    page.look(false);
    if (world.chance(0.3)) page.ask(0.5, 0.5);
    if (kind < 0.5 || world.chance(0.1)) await page.wait(world.random(0, 9000));
    if (page.starts.length > 0 && world.chance(0.002)) page.send({ type: 'lost', number: 0 });
    if (kind < 0.1) page.send({ type: 'hide', hidden: false });
    else if (kind < 0.5) {
        network.isDown = network.isRefusing = false;
        if (world.chance(0.5)) page.send({ type: 'retry' });
    }
}

/// The view settles, what is settled rests, and it is what a viewer settles on that saw nothing before.
async function rests(page, compares) {
    const { network } = page;
    // What failed while the network was down is asked for again where that is said.
    await page.until(() => page.settled || page.problem);
    if (!page.settled) while (await world.step());
    if (!page.settled) {
        assert.equal(page.drawn ?? page.number, page.number, `what is there is drawn: ${page.problem}`);
        ++problems;
        page.send({ type: 'retry' });
        await page.until(() => page.settled);
    }
    page.problem = null;
    assert.ok(page.settled.settled && page.settled.pagesMissing === 0);
    const { settled, number } = page, { events } = world;
    while (await world.step()) assert.ok(world.events < events + kRestEvents, 'it does not rest');
    assert.equal(network.underWay, 0);
    assert.equal(page.asked, 0, 'each question is answered');
    assert.equal(page.problem ?? null, null);
    if (!compares) return;
    const ranges = new Ranges('scan.vcp', server(network.bytes)), alone = await opened(ranges, page.budgetBytes);
    alone.look(page.view);
    const expected = await settle(alone, ranges, page.budgetBytes, ({ width, height }) => grey(width, height));
    assert.equal(settled.relaxed, expected.relaxed);
    relaxed += settled.relaxed;
    for (let i = 0; i < 20; ++i) {
        const [x, y] = [world.random(0, 1), world.random(0, 1)], hit = await page.hitAt(x, y);
        const theirs = alone.pick(Math.floor(x * page.view.width), Math.floor(y * page.view.height));
        assert.equal(hit?.depth, theirs?.depth, `view ${number} at ${x}, ${y}: ${JSON.stringify([settled, expected, page.view])}`);
        hits += hit !== null;
    }
}
let hits = 0, relaxed = 0, problems = 0, drew = 0;

/// Returns the views of a page.
async function visit(scan, budget, workers) {
    Object.assign(world, { slowness: world.pick([0, 20, 400]), mode: 0, occlusion: 0, fine: 0.5 });
    world.network = new Network(fs.readFileSync(scan));
    const page = await Page.open(world.network, budget * 2 ** 20, workers);
    for (let view = 0; view < kViews; ++view) {
        await goOn(page);
        if (view === kViews - 1 || world.chance(0.3)) await rests(page, view === kViews - 1);
    }
    assert.equal(drawnSoon, 0, 'while it is drawn nothing is asked for');
    drew = Math.max(drew, page.workers);
    for (const module of modules.splice(0)) module.wasm = null; // its memory can go
}

for (let seed = Number(firstSeed); seed < Number(firstSeed) + Number(pages); ++seed) {
    world = new World(seed);
    const scan = world.pick(scans), budget = world.pick(kBudgets), workers = world.pick([0, 0, 1, 2]);
    await visit(scan, budget, workers).catch(error => {
        console.log(`seed ${seed}: ${path.basename(scan)}, ${budget} MiB, ${workers} more workers`);
        throw error;
    });
}
console.log(`settle_test: ${hits} hits are the same; ${relaxed} views were relaxed, ${problems} had to be tried again; at most ${drew} workers drew`);
assert.ok(hits > 40 && relaxed > 0 && problems > 0);
process.exit(0);
