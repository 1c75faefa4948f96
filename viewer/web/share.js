// How the first worker shares a picture with others. The picture is cut into bands of rows. Each worker casts bands that
// lie together, so few pages are needed twice; how many says what bands of the picture before cost. The policy, the pages
// and all requests are the first worker's; another one gets copies of the pages and tiles of images that its bands need, within
// a number of bytes, and what does not fit is cast by the first.

/// Returns parts of the bands that cost the same, { first, count } each, in order.
export function partsOf(costs, count) {
    const sum = costs.reduce((all, cost) => all + cost, 0), parts = [];
    let first = 0, reached = 0;
    for (let part = 1; part <= count; ++part) {
        let end = first;
        while (end < costs.length && (part === count || reached + costs[end] / 2 <= sum * part / count)) reached += costs[end++];
        parts.push({ first, count: end - first });
        first = end;
    }
    return parts;
}

/// Returns the costs of `bands` bands of a picture of whose bands, in another number perhaps, the costs are known.
export function costsOf(known, bands) {
    return Array.from({ length: bands }, (_, i) => Math.max(known[Math.floor((i + 0.5) * known.length / bands)] ?? 1, 1e-3));
}

/// Another worker, as the first one sees it.
export class Caster {
    /// `shareBytes`: most bytes of pages and tiles of images that it may hold.
    constructor(port, shareBytes) {
        Object.assign(this, { port, shareBytes, held: new Map(), heldBytes: 0, memoryBytes: 0, isReady: false, hasTables: false });
        port.onmessage = ({ data }) => {
            if (data.type === 'ready') this.isReady = true;
            else if (data.type === 'failed') this.lose();
            else {
                this.memoryBytes = data.memoryBytes;
                this.done(data);
            }
        };
        port.onmessageerror = () => this.lose();
        this.done = () => {};
    }
    /// It is gone: nothing more is asked of it.
    lose() {
        this.isReady = false;
        this.done(null);
    }

    /// Returns what `part` needs, as Module.needed(), with fewer bands in it where that would be too much.
    fit(module, rows, part) {
        for (let { first, count } = part; count > 0;) {
            const needed = module.needed(first * rows, count * rows);
            const bytes = needed.list.reduce((sum, one) => sum + one.bytes, 0);
            if (bytes <= this.shareBytes) return { first, count, needed, bytes };
            count = Math.min(count - 1, Math.floor(count * this.shareBytes / bytes));
        }
        return { first: part.first, count: 0 };
    }

    /// Returns the tables of images, the first time that tiles of some are needed; null otherwise.
    tablesFor(module, tiles) {
        if (this.hasTables || tiles.length === 0) return null;
        this.hasTables = true;
        return module.imageTables();
    }

    /// Casts what fit() returned. Returns a promise of what castBands() and said() return, or of null where it is gone.
    cast(module, { view, sample, begun, shows }, { first, count, needed }) {
        const copies = [], dropped = [], { records, tiles, list } = needed, tables = this.tablesFor(module, tiles);
        const wanted = new Set(list.map(one => one.key));
        const more = list.reduce((sum, one) => sum + (this.held.has(one.key) ? 0 : one.bytes), 0);
        // What was used longest ago goes first.
        for (const [key, bytes] of this.held) {
            if (this.heldBytes + more <= this.shareBytes) break;
            if (wanted.has(key)) continue;
            dropped.push(key);
            this.held.delete(key);
            this.heldBytes -= bytes;
        }
        for (const { key, bytes, address } of list) {
            if (this.held.delete(key)) this.heldBytes -= bytes;
            else copies.push({ key, bytes: module.copyOf(address, bytes) });
            this.held.set(key, bytes);
            this.heldBytes += bytes;
        }
        this.port.postMessage({ type: 'cast', view, sample, begun, needed: { records, tiles }, tables, copies, dropped, first, count, shows },
            copies.map(one => one.bytes.buffer));
        return new Promise(done => { this.done = done; });
    }
}
