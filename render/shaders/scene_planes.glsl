// The planes of light of a picture in which several things shade each other (frame_layout.h, kSceneNormal). Whoever
// includes it gives sceneLight and targetDepths, the buffers; scenePlane(), the words of a plane; and hit_light.h.

uint sceneAt(uint plane, uint pixel) { return plane * scenePlane() + pixel; }

float sceneDepth(uint pixel) { return uintBitsToFloat(targetDepths[pixel]); }

// Returns how much sky is seen, averaged over the pixels around that are no farther than `reach` from a depth: each
// pixel of a square of 4 x 4 has directions of its own. `size`: of the picture.
float sceneSkyAbout(uvec2 pixel, uvec2 size, float depth, float reach) {
    float sum = 0.0, count = 0.0;
    for (int i = 0; i < 16; i++) {
        ivec2 p = clamp(ivec2(pixel) + ivec2((i & 3) - 1, (i >> 2) - 1), ivec2(0), ivec2(size) - 1);
        uint at = uint(p.y) * size.x + uint(p.x);
        bool same = abs(sceneDepth(at) - depth) <= reach;
        sum += same ? unpackUnorm4x8(sceneLight[sceneAt(kSceneLight, at)]).y : 0.0;
        count += same ? 1.0 : 0.0;
    }
    return sum / max(count, 1.0);
}

// Returns the light of a pixel before a light's ray: the first of all rays finds everything lit.
uint lightBefore(uint pixel, bool isFirstOfAll) {
    return isFirstOfAll ? packUnorm4x8(vec4(1.0, 1.0, 0.0, 0.0)) : sceneLight[sceneAt(kSceneLight, pixel)];
}

// Keeps how far a ray into the sky came, `near`, for what it goes through next; once it has gone through all, adds what
// it sees of the sky. The sum over all rays becomes light with the last one. Lengths are world units.
void keepSkyRay(uint pixel, float near, uint number, uint rays, bool isLast, float reach) {
    if (!isLast) {
        sceneLight[sceneAt(kSceneNear, pixel)] = floatBitsToUint(near);
        return;
    }
    uint at = sceneAt(kSceneLight, pixel);
    float part = near / reach;
    float open = (number == 0u ? 0.0 : uintBitsToFloat(sceneLight[at])) + (part < 1.0 ? skyBehind(part) : 1.0);
    sceneLight[at] = number + 1u < rays ? floatBitsToUint(open) : packUnorm4x8(vec4(1.0, open / float(rays), 0.0, 0.0));
}
