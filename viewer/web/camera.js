// The camera of a viewer: it orbits a point. World space, double precision.

const kLeastPitch = -1.55, kMostPitch = 1.55;
export const kFieldOfView = 0.6; // radians, from the lower to the upper edge

const kFarthest = 1e15; // of what links say: no picture can be made from much farther away
const kFitted = 0.96; // of the picture's half sides, for the whole box

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const add = (a, b, s = 1) => a.map((x, i) => x + s * b[i]);
export const length = a => Math.hypot(...a);
export const difference = (a, b) => add(a, b, -1);

/// Returns the axis that points up in a scan, 'y' or 'z', as far as the box about it says: upOf() in
/// viewer/camera/orbit_camera.cpp, with y where that says nothing.
export function upOf(boundsMin, boundsMax) {
    const [x, y, z] = difference(boundsMax, boundsMin), away = boundsMin.map((low, i) => Math.abs(low + boundsMax[i]) / 2);
    const nearer = Math.min(away[0], away[1]), shorter = Math.min(x, y);
    const isOnMap = nearer > 10 * Math.hypot(x, y, z) && away[2] < 0.1 * nearer;
    const isFlat = shorter > 0 && z <= 0.25 * shorter, isTall = z > 0 && z >= 1.5 * Math.max(x, y);
    return isOnMap || isFlat || isTall ? 'z' : 'y';
}

export class Orbit {
    constructor() {
        this.up = 'y'; // the axis of the mesh that points up, or 'z'
        this.target = [0, 0, 0];
        this.distance = 1;
        this.yaw = 0.6;
        this.pitch = 0.35;
    }

    /// Looks at the whole box from the direction that it has: each corner is within `kFitted` of the picture.
    fit(boundsMin, boundsMax, aspect) {
        this.target = boundsMin.map((x, i) => (x + boundsMax[i]) / 2);
        this.radius = length(difference(boundsMax, boundsMin)) / 2 || 1;
        const { right, up, forward } = this.axes(), half = Math.tan(kFieldOfView / 2) * kFitted;
        this.distance = this.radius * 1e-3;
        for (let i = 0; i < 8; ++i) {
            const corner = boundsMin.map((low, axis) => (i >> axis & 1 ? boundsMax[axis] : low) - this.target[axis]);
            const away = Math.max(Math.abs(dot(corner, right)) / aspect, Math.abs(dot(corner, up))) / half;
            this.distance = Math.max(this.distance, away - dot(corner, forward));
        }
    }

    /// Unit axes: right, up and forward.
    axes() {
        const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
        const axes = { right: [cy, 0, -sy], up: [-sy * sp, cp, -cy * sp], forward: [-sy * cp, -sp, -cy * cp] };
        if (this.up === 'z') for (const name in axes) axes[name] = [axes[name][0], -axes[name][2], axes[name][1]];
        return axes;
    }
    eye() {
        return add(this.target, this.axes().forward, -this.distance);
    }

    /// Turns by pixels of a picture so many pixels high.
    turn(dx, dy, height) {
        this.yaw -= 3.2 * dx / height;
        this.pitch = Math.min(Math.max(this.pitch + 3.2 * dy / height, kLeastPitch), kMostPitch);
    }
    /// Moves the target so that what is at its distance follows the pointer.
    pan(dx, dy, height) {
        const unit = 2 * this.distance * Math.tan(kFieldOfView / 2) / height;
        const { right, up } = this.axes();
        this.target = add(add(this.target, right, -dx * unit), up, dy * unit);
    }
    /// Comes nearer by a factor below 1, or goes away; the point under (x, y), in half heights from the middle, stays.
    zoom(factor, x, y) {
        const distance = Math.min(Math.max(this.distance * factor, this.radius * 1e-5), this.radius * 50);
        const moved = (this.distance - distance) * Math.tan(kFieldOfView / 2);
        const { right, up } = this.axes();
        this.target = add(add(this.target, right, x * moved), up, -y * moved);
        this.distance = distance;
    }

    /// The camera as a link has it, and back; false where the text is none.
    toText() {
        return [...this.target, this.distance, this.yaw, this.pitch].map(x => Number(x.toPrecision(9))).join(',');
    }
    fromText(text) {
        const n = text.split(',').map(Number);
        if (n.length !== 6 || !n.every(x => Math.abs(x) <= kFarthest) || !(n[3] > 0)) return false;
        this.target = n.slice(0, 3);
        [this.distance, this.yaw, this.pitch] = n.slice(3);
        this.pitch = Math.min(Math.max(this.pitch, kLeastPitch), kMostPitch);
        return true;
    }

    /// Where a world point is seen in a picture, in pixels; null behind the eye.
    project(point, width, height) {
        const { right, up, forward } = this.axes(), to = difference(point, this.eye());
        const depth = dot(to, forward);
        if (!(depth > 0)) return null;
        const scale = height / 2 / Math.tan(kFieldOfView / 2) / depth;
        return { x: width / 2 + dot(to, right) * scale, y: height / 2 - dot(to, up) * scale, depth };
    }
}

/// A light that follows the camera: from which side (0: the camera's, positive: from the right) and from how far above,
/// in degrees.
export class Light {
    constructor(side = -25, above = 33.7) {
        this.set(side, above);
    }
    set(side, above) {
        this.side = ((side + 180) % 360 + 360) % 360 - 180;
        this.above = Math.min(Math.max(above, -90), 90);
    }
    /// Follows a drag by pixels of a picture so many pixels high.
    turn(dx, dy, height) {
        this.set(this.side + 180 * dx / height, this.above - 180 * dy / height);
    }
    /// Unit, towards it, in the camera's axes: right, up, back.
    direction() {
        const [a, e] = [this.side, this.above].map(x => x * Math.PI / 180);
        return [Math.sin(a) * Math.cos(e), Math.sin(e), Math.cos(a) * Math.cos(e)];
    }
    toText() {
        return `${Math.round(this.side * 10) / 10},${Math.round(this.above * 10) / 10}`;
    }
    /// Returns false where the text is none.
    fromText(text) {
        const n = text.split(',').map(Number);
        if (n.length !== 2 || !n.every(Number.isFinite)) return false;
        this.set(n[0], n[1]);
        return true;
    }
}

/// Returns the section that a text names, { normal, offset }, or null: an axis, `x` to keep what lies beyond the plane
/// and `-x` what lies before it, and where it cuts the box, 0 to 1: `-x,0.5`.
export function sectionOf(text, boundsMin, boundsMax) {
    const match = /^(-?)([xyz]),([0-9.]+)$/.exec(text ?? '');
    if (!match || !(Number(match[3]) <= 1)) return null;
    const axis = 'xyz'.indexOf(match[2]), sign = match[1] ? -1 : 1;
    const place = boundsMin[axis] + Number(match[3]) * (boundsMax[axis] - boundsMin[axis]);
    return { normal: [0, 1, 2].map(i => (i === axis ? sign : 0)), offset: sign * place };
}

const kMovingMs = 50, kLeastScale = 0.1;

/// Returns the part of the resolution, along each side, of the next picture of a view that moves, where the one before had
/// `scale` and took `ms`. What is near enough stays, so that resolutions do not change all the time.
export function movingScale(scale, ms) {
    if (ms > 0.6 * kMovingMs && ms <= kMovingMs) return scale;
    const by = Math.sqrt(0.8 * kMovingMs / Math.max(ms, 1));
    return Math.min(Math.max(scale * Math.min(Math.max(by, 0.5), 1.5), kLeastScale), 1);
}
