// The planes of light of a picture in which several things shade each other (frame_layout.h, kSceneNormal). Whoever
// includes it gives sceneLight, the buffer; scenePlane(), the words of a plane; and hit_light.h.

uint sceneAt(uint plane, uint pixel) { return plane * scenePlane() + pixel; }

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
