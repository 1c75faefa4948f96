// Reads stretches of a file from a web server: one range a request, nothing that would preflight across origins.

const kAttempts = 4;
const kFirstDelay = 300; // ms; twice as long after each failure
const kSilentMs = 15e3; // twice in a row without a byte, and the connection is taken for lost

/// What went wrong with the server: a line for people. Trying again does not help.
export class ServerError extends Error {}
/// The server does not have the file.
export class MissingFile extends ServerError {}

/// Returns the first byte and the size of the whole file that a Content-Range names; nothing where it is none.
export function parseContentRange(text) {
    const match = /^bytes (\d+)-(\d+)\/(\d+)$/.exec(text ?? '');
    if (!match) return null;
    const [first, last, size] = match.slice(1).map(Number);
    return first <= last && last < size ? { first, last, size } : null;
}

/// Joins stretches that lie at most `gap` bytes from each other, up to `most` bytes together.
export function joined(stretches, gap, most) {
    const sorted = [...stretches].sort((a, b) => a.offset - b.offset);
    const runs = [];
    for (const { offset, bytes } of sorted) {
        const run = runs[runs.length - 1];
        const end = Math.max(offset + bytes, run ? run.offset + run.bytes : 0);
        if (run && offset <= run.offset + run.bytes + gap && end - run.offset <= most) run.bytes = end - run.offset;
        else runs.push({ offset, bytes });
    }
    return runs;
}

export function overlap(a, b) {
    return a.offset < b.offset + b.bytes && b.offset < a.offset + a.bytes;
}

/// Orders runs by which holds the first of some stretches, which are ordered.
export function urgentFirst(runs, stretches) {
    const first = new Map(runs.map(run => [run, stretches.findIndex(one => overlap(one, run))]));
    return [...runs].sort((a, b) => first.get(a) - first.get(b));
}

/// Returns what of stretches is in none of others.
export function without(stretches, others) {
    return others.reduce((left, other) => left.flatMap(({ offset, bytes }) => {
        const end = offset + bytes, otherEnd = other.offset + other.bytes;
        if (otherEnd <= offset || other.offset >= end) return [{ offset, bytes }];
        return [{ offset, bytes: other.offset - offset }, { offset: otherEnd, bytes: end - otherEnd }].filter(part => part.bytes > 0);
    }), stretches);
}

export class Ranges {
    /// `fetch`: as the browser's; another one for tests.
    constructor(url, fetch = (...all) => globalThis.fetch(...all)) {
        this.url = url;
        this.fetch = fetch;
        this.size = null; // of the file, once the first answer came
        this.requests = 0;
        this.bytes = 0;
        this.tag = null;
        this.delay = kFirstDelay;
        this.silentMs = kSilentMs;
    }

    /// Returns the bytes from `offset` on, `bytes` of them, fewer where the file ends. `anew`: not from a cache.
    async read(offset, bytes, { anew = false, signal } = {}) {
        for (let attempt = 1; ; ++attempt) {
            try {
                return await this.once(offset, bytes, anew, signal);
            } catch (error) {
                if (error instanceof ServerError || signal?.aborted || attempt === kAttempts) throw error;
                await new Promise(done => setTimeout(done, this.delay * 2 ** (attempt - 1)));
            }
        }
    }

    async once(offset, bytes, anew, signal) {
        const abort = new AbortController(), silence = this.silence(abort);
        signal?.addEventListener('abort', () => abort.abort(), { once: true });
        ++this.requests;
        const end = () => (this.size === null ? offset + bytes : Math.min(offset + bytes, this.size));
        try {
            const answer = await this.fetch(this.url, {
                headers: { Range: `bytes=${offset}-${end() - 1}` },
                cache: anew ? 'reload' : 'default',
                signal: abort.signal,
            }).catch(() => {
                // Browsers do not tell a page which of these it is.
                throw new Error(`${this.url}: the server cannot be reached, lets no other site's pages in, or compresses ranges`);
            });
            this.check(answer, offset);
            // The first answer says where the file ends.
            const expected = end() - offset, got = await this.bytesOf(answer, silence, expected);
            if (this.size !== null && got.length < expected) throw new Error(`${this.url}: the answer was cut off`);
            return got;
        } catch (error) {
            abort.abort(); // the rest of a whole file is not downloaded
            throw silence.isLong ? new Error(`${this.url}: the server does not answer`) : error;
        } finally {
            clearInterval(silence.timer);
        }
    }
    /// Returns the bytes of an answer. Errors: there are more than that.
    async bytesOf(answer, silence, most) {
        const reader = answer.body.getReader(), got = new Uint8Array(most);
        let count = 0;
        const next = () => reader.read().catch(() => { throw new Error(`${this.url}: the answer was cut off`); });
        for (let piece = await next(); !piece.done; piece = await next()) {
            silence.heard = true;
            if (count + piece.value.length > most) throw new ServerError(`${this.url}: the server sent more bytes than asked for`);
            got.set(piece.value, count);
            count += piece.value.length;
        }
        this.bytes += count;
        return got.subarray(0, count);
    }
    /// Ends a request of which nothing is heard any more: no browser does so soon. While this thread was busy it could
    /// hear nothing.
    silence(abort) {
        const silence = { heard: true, isLong: false };
        let last = performance.now();
        silence.timer = setInterval(() => {
            const isLate = performance.now() - last > 1.5 * this.silentMs;
            silence.isLong = !silence.heard && !isLate;
            silence.heard = isLate;
            last = performance.now();
            if (silence.isLong) abort.abort();
        }, this.silentMs);
        return silence;
    }

    check(answer, offset) {
        if (answer.status === 200)
            throw new ServerError(`${this.url}: the server ignores ranges and sends the whole file; use one that knows Range requests`);
        if (answer.status === 404 || answer.status === 410) throw new MissingFile(`${this.url}: the server has no such file`);
        if (answer.status === 416)
            throw new ServerError(`${this.url}: the file on the server is shorter than before; reload the page`);
        if (answer.status >= 400 && answer.status < 500 && answer.status !== 408 && answer.status !== 429)
            throw new ServerError(`${this.url}: the server answers ${answer.status}`);
        if (answer.status !== 206) throw new Error(`${this.url}: the server answers ${answer.status}`);
        const encoding = answer.headers.get('Content-Encoding');
        if (encoding && encoding !== 'identity')
            throw new ServerError(`${this.url}: the server compresses ranges (${encoding}); switch that off for .vcp`);
        const range = parseContentRange(answer.headers.get('Content-Range'));
        // Across origins the header may be hidden; then the hashes alone say what came.
        if (range && range.first !== offset) throw new ServerError(`${this.url}: the server sent another range than asked for`);
        if (range && this.size !== null && range.size !== this.size)
            throw new ServerError(`${this.url}: the file was replaced on the server; reload the page`);
        const tag = answer.headers.get('ETag');
        if (tag && this.tag && tag !== this.tag)
            throw new ServerError(`${this.url}: the file was replaced on the server; reload the page`);
        this.tag ??= tag;
        if (this.size === null && range) this.size = range.size;
        if (this.size === null)
            throw new ServerError(`${this.url}: the server hides Content-Range; it must send Access-Control-Expose-Headers: Content-Range`);
    }
}

/// The address of a file beside another, with the same query.
export function addressBeside(url, name) {
    const [, path, rest] = /^([^?#]*)(.*)$/.exec(url);
    return path.slice(0, path.lastIndexOf('/') + 1) + name + rest;
}

/// The files that a scan is in, each read as Ranges are. `placeOf`: as the module's.
export class Files {
    constructor(url, fetch) {
        this.url = url;
        this.fetch = fetch;
        this.first = new Ranges(url, fetch);
        this.others = new Map(); // by name
        this.placeOf = offset => ({ name: '', offset });
    }

    get size() { return this.first.size; }
    get requests() { return this.sum(file => file.requests); }
    get bytes() { return this.sum(file => file.bytes); }
    sum(of) { return [this.first, ...this.others.values()].reduce((sum, file) => sum + of(file), 0); }

    read(offset, bytes, options) {
        const place = this.placeOf(offset);
        return this.fileNamed(place.name).read(place.offset, bytes, options);
    }
    fileNamed(name) {
        if (name === '') return this.first;
        if (!this.others.has(name)) this.others.set(name, new Ranges(addressBeside(this.url, name), this.fetch));
        return this.others.get(name);
    }
}
