// What `vcp render --depth` saw, against what the viewer for browsers sees.
import fs from 'node:fs';

/// Returns distances along the unit rays, row by row from the upper left; infinite where nothing is hit.
export function readDepth(file, width, height) {
    const bytes = fs.readFileSync(file), floats = bytes.subarray(bytes.length - 4 * width * height);
    // A PFM begins with its lowest row.
    return Float32Array.from({ length: width * height }, (_, i) =>
        floats.readFloatLE(4 * ((height - 1 - Math.floor(i / width)) * width + i % width)));
}

/// Returns how many pixels differ beyond `tolerance`, and how many of `ours` are hits.
export function compareDepth(ours, theirs, tolerance) {
    let differ = 0, hits = 0;
    theirs.forEach((depth, i) => {
        const isHit = Number.isFinite(ours[i]);
        hits += isHit ? 1 : 0;
        if (isHit !== Number.isFinite(depth) || (isHit && !(Math.abs(ours[i] - depth) <= tolerance))) ++differ;
    });
    return { differ, hits };
}
