// A worker that casts bands of pictures for the first worker (worker.js), from copies of what they need.
import { Module } from './module.js';

let module;

/// Does a job of the first worker's (share.js).
function cast({ view, sample, begun, needed, tables, copies, dropped, first, count, shows }) {
    if (tables) module.followImages(tables);
    for (const key of dropped) module.drop(key);
    for (const { key, bytes } of copies) module.take(key, bytes);
    module.look(view);
    const { rows } = module.beginCopied(needed, sample, begun);
    return { ...module.castBands(view, rows, first, count, shows), said: module.said() };
}

self.onmessage = async ({ data: { port, compiled, lead } }) => {
    const fail = () => port.postMessage({ type: 'failed' }); // the first worker does without
    try {
        module = await Module.load(compiled);
        module.follow(lead);
    } catch {
        return fail();
    }
    port.onmessage = ({ data }) => {
        try {
            const done = cast(data);
            port.postMessage({ type: 'cast', ...done, memoryBytes: module.memoryBytes() }, done.pixels ? [done.pixels.buffer] : []);
        } catch {
            fail();
        }
    };
    port.onmessageerror = fail; // there is no memory for a copy
    port.postMessage({ type: 'ready' });
};
