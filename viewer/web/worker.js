// The worker of a viewer: fetches, decodes and draws, so that the page never waits.
import { Module } from './module.js';
import { Ranges, joined } from './ranges.js';

const kLead = 64 << 10;      // bytes of the first request: header, directory and the coarsest pages
const kGap = 32 << 10;       // pages so near each other are fetched in one request
const kMostBytes = 256 << 10; // of one request
const kAtOnce = 4;           // requests
const kFrameMs = 16; // between frames that nothing else asks for
const kSamples = 8;          // of a pixel, where a view is at rest

let module, ranges, view = null, awake = null, fetching = 0, failed = null, drawn = null, hidden = false;
const asked = new Set(); // offsets under way

function post(type, more = {}, transfer = []) {
    self.postMessage({ type, ...more }, transfer);
}

async function supply(stretches) {
    await Promise.all(joined(stretches, kGap, kMostBytes).map(async ({ offset, bytes }) => {
        module.supply(offset, await ranges.read(offset, bytes));
    }));
}

async function open({ url, wasm, budgetBytes }) {
    const program = await fetch(wasm);
    if (!program.ok) throw new Error(`${wasm}: the server answers ${program.status}; copy the whole folder of the viewer`);
    module = await Module.load(program);
    ranges = new Ranges(url);
    const lead = await ranges.read(0, kLead);
    module.begin(ranges.size, url, budgetBytes);
    module.supply(0, lead);
    while (!module.open()) await supply(module.missing());
    post('opened', { info: module.info() });
}

/// Fetches what the module misses; the loop goes on when it has come.
function fetchMissing() {
    for (const run of joined(module.missing(), kGap, kMostBytes)) {
        if (fetching >= kAtOnce || asked.has(run.offset)) continue;
        ++fetching;
        asked.add(run.offset);
        ranges.read(run.offset, run.bytes)
            .then(bytes => module.supply(run.offset, bytes))
            .catch(error => { failed = error; })
            .finally(() => {
                --fetching;
                asked.delete(run.offset);
                wake();
            });
    }
}

function wake() {
    awake?.();
    awake = null;
}

/// A line for people. What ends an instance of WebAssembly is want of memory (wasm/thrown.cpp).
function lineOf(error) {
    if (error instanceof WebAssembly.RuntimeError || error instanceof RangeError)
        return 'the browser has no more memory for this scan; a smaller `budget` may do';
    return error.message;
}

/// Draws the view anew and shows it.
function draw(update, samples) {
    const { width, height } = view;
    const pixels = module.picture(width, height);
    post('picture', {
        width, height, pixels, number: view.number, samples, fetched: { requests: ranges.requests, bytes: ranges.bytes },
        update, memoryBytes: module.memoryBytes(),
    }, [pixels.buffer]);
}

/// What is seen at a place of the picture, 0 to 1 from its upper left corner; null where the view has not been drawn.
function hitAt({ x, y }) {
    if (drawn === null || drawn.view !== view) return null;
    const texel = (at, size) => Math.min(Math.max(Math.floor(at * size), 0), size - 1);
    return module.pick(texel(x, view.width), texel(y, view.height));
}

async function run() {
    for (;;) {
        if (failed) {
            post('error', { message: failed.message });
            failed = null;
            await new Promise(done => { awake = done; });
            continue;
        }
        if (hidden) {
            await new Promise(done => { awake = done; });
            continue;
        }
        const now = view;
        module.look(now);
        const update = module.update();
        fetchMissing();
        if (update.problem) post('problem', { message: update.problem });
        const isNew = drawn?.view !== now || update.changed || update.awaitsRays;
        if (update.drawable && isNew) {
            module.render();
            drawn = { view: now, samples: 1 };
            draw(update, 1);
        } else if (update.settled && !now.moving && drawn?.view === now && drawn.samples < kSamples && now.mode < 3) {
            const samples = module.refine();
            drawn.samples = samples === 0 ? kSamples : samples;
            if (samples > 0 && (samples & (samples - 1)) === 0) draw(update, samples);
        } else if (view === now) {
            if (update.settled && !now.moving) post('settled', { number: now.number, update });
            await new Promise(done => {
                awake = done;
                // The policy may need more frames before it lets pages go that were seen a moment ago.
                if (!update.settled && fetching === 0) setTimeout(done, kFrameMs);
            });
        }
        // Messages of the page come in between.
        await new Promise(done => setTimeout(done));
    }
}

self.onmessage = async ({ data }) => {
    try {
        if (data.type === 'open') await open(data);
        else if (data.type === 'look') {
            const isFirst = view === null;
            view = data;
            if (isFirst) run().catch(error => post('error', { message: lineOf(error) }));
            else wake();
        } else if (data.type === 'pick') {
            post('picked', { id: data.id, hit: hitAt(data) });
        } else if (data.type === 'hide') {
            hidden = data.hidden; // nothing is drawn that nobody sees
            wake();
        } else if (data.type === 'retry') wake();
    } catch (error) {
        post('error', { message: lineOf(error) });
    }
};
