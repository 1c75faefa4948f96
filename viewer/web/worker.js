// The first worker of a viewer: fetches, decodes, chooses pages and draws, with others where there are any (share.js), so
// that the page never waits.
import { Choice } from './choice.js';
import { Module } from './module.js';
import { Files, MissingFile, joined, overlap, urgentFirst, without } from './ranges.js';
import { Caster, costsOf, partsOf } from './share.js';

const kLead = 64 << 10;      // bytes of the first request: header, directory and the coarsest pages
const kGap = 32 << 10;       // pages, and pieces of images, so near each other are fetched in one request
const kMostBytes = 256 << 10; // of one request
const kAtOnce = 12, kBytesAtOnce = 1 << 20; // requests, and bytes that they ask for
const kAtFirst = 1;          // request, until there is a picture: it comes sooner where nothing else does
const kFrameMs = 16; // between frames that nothing else asks for
const kSamples = 8;          // of a pixel, where a view is at rest

let told = null; // the picture that was said to be settled
let isStale = false, drawnAt = 0, drawnMs = 0; // whether the cut is another one than the picture's; when that was done, and how long it took
let module, ranges, view = null, awake = null, drawn = null, hidden = false, hasShown = false, decoding = 0;
const asked = new Set(); // stretches under way
let failed = null; // what could not be had: the error, and the stretch where it is one
let isStopped = false; // nothing more is asked for until the page says so, or shows another view
let fetched = []; // stretches that came
const casters = []; // the other workers
let plan = null; // which bands of the picture are whose
let costs = []; // milliseconds of each band of the last picture
let choice, byGpu = false, isAgain = false, castMs = 0; // who draws, who the picture at hand, whether it was shown before, and how long the processor took for its last sample

function post(type, more = {}, transfer = []) {
    self.postMessage({ type, ...more }, transfer);
}

async function supply(stretches) {
    await Promise.all(joined(stretches, kGap, kMostBytes).map(async ({ offset, bytes }) => {
        module.supply(offset, await ranges.read(offset, bytes));
    }));
}

async function open({ url, wasm, budgetBytes, draw }) {
    const program = await fetch(wasm);
    if (!program.ok) throw new Error(`${wasm}: the server answers ${program.status}; copy the whole folder of the viewer`);
    module = await Module.load(program);
    choice = new Choice(module, draw, wake);
    ranges = new Files(url);
    const lead = await ranges.read(0, kLead);
    module.begin(ranges.size, url, budgetBytes);
    module.supply(0, lead);
    ranges.placeOf = offset => module.placeOf(offset);
    while (!module.open()) await supply(module.missing());
    post('opened', { info: module.info(), start: { compiled: module.compiled, lead: module.lead() } });
}

/// Fetches what the module misses, the most urgent first; the loop goes on when it has come. What failed is said where
/// it is still missed.
function fetchMissing() {
    const all = module.missing(), underWay = [...asked], missing = without(all, underWay);
    if (failed && (!failed.part || all.some(one => overlap(one, failed.part)))) {
        post('error', { message: lineOf(failed.error) });
        isStopped = true;
    }
    failed = null;
    if (isStopped) return;
    let bytesAsked = underWay.reduce((sum, run) => sum + run.bytes, 0);
    for (const run of urgentFirst(joined(missing, kGap, kMostBytes), missing)) {
        // What is joined may have something between that is under way, or was fetched before.
        const there = [...underWay, ...without(fetched.filter(one => overlap(one, run)), missing)];
        for (const part of without([run], there)) {
            const [wanted] = joined(missing.filter(one => overlap(one, part)), Infinity, Infinity);
            if (asked.size >= (hasShown ? kAtOnce : kAtFirst) || bytesAsked >= kBytesAtOnce) return;
            if (!wanted) continue;
            bytesAsked += wanted.bytes;
            fetchPart(wanted);
        }
    }
}
function fetchPart(part) {
    asked.add(part);
    ranges.read(part.offset, part.bytes)
        .then(bytes => {
            module.supply(part.offset, bytes);
            fetched = joined([...fetched, part], 0, Infinity);
        })
        .catch(error => {
            // Without one of several files the others are shown.
            if (error instanceof MissingFile && module.placeOf(part.offset).name !== '') module.lose(part.offset, error.message);
            else failed = { error, part };
        })
        .finally(() => {
            asked.delete(part);
            wake();
        });
}

/// Decodes JPEGs that the module has no decoder for; the loop goes on when their texels are there.
function decodeJpegs() {
    for (const jpeg of module.jpegs()) {
        ++decoding;
        texelsOf(jpeg).catch(() => null).then(texels => {
            --decoding;
            module.putJpeg(jpeg.id, texels);
        }).catch(error => { failed = { error }; }).finally(wake);
    }
}

/// Returns the texels of a JPEG, RGBA8, as they are stored: no colour is matched to the screen's.
async function texelsOf({ bytes, width, height }) {
    const image = await createImageBitmap(new Blob([bytes], { type: 'image/jpeg' }), { colorSpaceConversion: 'none' });
    if (image.width !== width || image.height !== height) throw new Error('it has another size');
    const context = new OffscreenCanvas(width, height).getContext('2d', { willReadFrequently: true });
    context.drawImage(image, 0, 0);
    image.close();
    return context.getImageData(0, 0, width, height).data;
}

function wake() {
    awake?.();
    awake = null;
}

/// What ends an instance of WebAssembly is want of memory (wasm/thrown.cpp).
function isWantOfMemory(error) {
    return error instanceof WebAssembly.RuntimeError || error instanceof RangeError;
}
/// A line for people.
function lineOf(error) {
    if (isWantOfMemory(error))
        return 'the browser has no more memory for this scan; a smaller `budget` may do';
    return error.message;
}

/// Shares the bands of a picture out. What another worker has no room for is cast here.
function planned({ bands, rows }) {
    const ready = casters.filter(caster => caster.isReady), parts = partsOf(costsOf(costs, bands), ready.length + 1);
    const own = [parts[0]], jobs = [];
    ready.forEach((caster, i) => {
        const part = parts[i + 1], fitted = caster.fit(module, rows, part);
        if (fitted.count > 0) jobs.push({ caster, part: fitted });
        if (fitted.count < part.count) own.push({ first: part.first + fitted.count, count: part.count - fitted.count });
    });
    return { own, jobs };
}

/// Draws a sample of the view, and shows the picture where it is worth it. Returns how many samples there are then; 0
/// where the picture cannot go on, null where it must be begun again.
function draw(view, update, sample) {
    if (sample === 0) byGpu = choice.isGpus(view);
    return byGpu ? drawByGpu(view, update, sample) : cast(view, update, sample);
}

function drawByGpu(view, update, sample) {
    const began = performance.now(), drawn = choice.draw(view, sample, isShown(sample), update.settled);
    if (drawn === undefined) byGpu = false;
    if (!drawn) return drawn === null ? 0 : null;
    if (drawn.picture) show(view, update, sample + 1, { bitmap: drawn.picture }, performance.now() - began);
    return sample + 1;
}

/// Pictures of 1, 2, 4, 8 samples are; of one that is there already, the last.
function isShown(sample) {
    return isAgain ? sample === kSamples - 1 : (sample + 1 & sample) === 0;
}

/// Does it by the processor.
async function cast(view, update, sample) {
    const began = performance.now(), begun = module.beginSample(sample), { rows } = begun, { width, height } = view;
    if (begun.bands === 0) return 0;
    if (sample === 0) plan = planned(begun);
    else if (plan.jobs.some(({ caster }) => !caster.isReady)) return null;
    const shows = isShown(sample), pixels = shows ? new Uint8ClampedArray(4 * width * height) : null;
    const ms = Array(begun.bands).fill(0);
    const put = (first, done) => {
        done.ms.forEach((x, i) => { ms[first + i] = x; });
        if (shows) pixels.set(done.pixels, 4 * width * first * rows);
    };
    const castHere = ({ first, count }) => put(first, module.castBands(view, rows, first, count, shows));
    // The pages of a part are those of its first sample, as the cut is.
    const asked = plan.jobs.map(({ caster, part }) => caster.cast(module, { view, sample, begun, shows }, part));
    plan.own.forEach(castHere);
    const answers = await Promise.all(asked), kept = [];
    answers.forEach((done, i) => {
        const { part } = plan.jobs[i];
        if (done === null) return plan.own.push(part);
        kept.push(plan.jobs[i]);
        put(part.first, done);
        module.hear(done.said);
    });
    if (kept.length < plan.jobs.length) {
        // The samples that a lost worker had are lost with it.
        if (sample > 0) return null;
        plan.own.slice(kept.length - plan.jobs.length).forEach(castHere);
        plan.jobs = kept;
    }
    if (sample === 0) module.endSample(begun);
    costs = ms;
    castMs = performance.now() - began;
    if (shows) show(view, update, sample + 1, { pixels }, castMs);
    return sample + 1;
}

function show({ width, height, number, moving }, update, samples, picture, ms) {
    const fetched = { requests: ranges.requests, bytes: ranges.bytes }, ready = casters.filter(caster => caster.isReady);
    const memoryBytes = ready.reduce((sum, caster) => sum + caster.memoryBytes, module.memoryBytes());
    const gpuBytes = choice.gpu?.bytes() ?? 0, workers = byGpu ? 1 : 1 + ready.length, drawnBy = byGpu ? 'webgl' : 'processor';
    post('picture', { width, height, ...picture, number, samples, fetched, update, memoryBytes, gpuBytes, workers, drawnBy, moving, ms },
        [picture.bitmap ?? picture.pixels.buffer]);
    hasShown = true;
    choice.start();
}

/// What is seen at a place of the picture, 0 to 1 from its upper left corner; null where the view has not been drawn.
function hitAt({ x, y }) {
    if (drawn === null || drawn.view !== view) return null;
    const texel = (at, size) => Math.min(Math.max(Math.floor(at * size), 0), size - 1);
    return module.pick(texel(x, view.width), texel(y, view.height));
}

/// Draws views, each until it has settled and the next one comes. One that cannot be drawn is one line.
async function run() {
    for (;;) {
        const now = view;
        try {
            await turn(now);
        } catch (error) {
            post('error', { message: lineOf(error) });
            if (isWantOfMemory(error)) return; // nobody knows what is in the memory now
            drawn = null;
            if (view === now) await woken();
        }
        // Messages of the page come in between.
        await new Promise(done => setTimeout(done));
    }
}
/// Waits until something has happened, or so many milliseconds have passed.
function woken(mostMs = Infinity) {
    return new Promise(done => {
        awake = done;
        if (mostMs < Infinity) setTimeout(done, mostMs);
    });
}

/// Goes one step on with a view, or waits until something has happened.
async function turn(now) {
    if (hidden) return woken();
    module.look(now);
    const update = module.update();
    fetchMissing();
    decodeJpegs();
    if (update.problem) post('problem', { message: update.problem });
    isStale ||= update.changed;
    const isNew = drawn?.view !== now || isStale || update.awaitsRays;
    const isNowGpus = drawn?.view === now && !byGpu && choice.wanted === 'webgl' && choice.isGpus(now);
    // While pages come, a view that stands still is drawn half of the time at most: while it is drawn none are asked for.
    const waitMs = drawn?.view === now && asked.size > 0 && !update.awaitsRays ? drawnAt + drawnMs - performance.now() : 0;
    if (update.drawable && (isNew || isNowGpus) && waitMs <= 0) {
        isAgain = !isNew;
        isStale = false;
        const began = performance.now(), samples = await draw(now, update, 0);
        drawn = samples === null ? null : { view: now, samples };
        drawnAt = performance.now();
        drawnMs = drawnAt - began;
    } else if (!isNew && update.settled && !now.moving && drawn.samples < kSamples && now.mode < 3) {
        const samples = await draw(now, update, drawn.samples);
        drawn = samples === null ? null : { view: now, samples: samples === 0 ? kSamples : samples };
    } else if (view === now) {
        if (update.settled && !isNew && !now.moving) {
            if (told !== drawn) post('settled', { number: now.number, update });
            told = drawn;
            if (!byGpu && choice.isOpen(now, castMs)) choice.judge(now, castMs);
        }
        // The policy may need more frames before it lets pages go that were seen a moment ago.
        const needsFrames = !update.settled && !isStopped && asked.size + decoding === 0;
        await woken(needsFrames ? kFrameMs : waitMs > 0 ? waitMs : Infinity);
    }
}

self.onmessage = async ({ data }) => {
    try {
        if (data.type === 'open') await open(data);
        else if (data.type === 'look') {
            const isFirst = view === null;
            view = data;
            isStopped = false;
            if (isFirst) run();
            else wake();
        } else if (data.type === 'pick') {
            post('picked', { id: data.id, hit: hitAt(data) });
        } else if (data.type === 'caster') {
            casters[data.number] = new Caster(data.port, data.shareBytes); // takes part once it is ready
        } else if (data.type === 'lost') {
            casters[data.number].lose();
        } else if (data.type === 'hide') {
            hidden = data.hidden; // nothing is drawn that nobody sees
            wake();
        } else if (data.type === 'retry') {
            isStopped = false;
            wake();
        }
    } catch (error) {
        post('error', { message: lineOf(error) });
    }
};
