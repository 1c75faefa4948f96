// What the channels of a material say at a hit, as render/host/tile_channels.cpp has it; after cast.glsl.

struct HitChannels {
    bool areThere;
    vec3 normal;  // unit, towards the viewer
    float roughness, metalness;
    vec3 emission;  // light
};

// Reads those of a triangle. `record`: 12 words from there on (images.glsl).
HitChannels readChannels(uint record, ImagedTriangle t, ImagedPoint p, vec3 normal) {
    uvec4 images = imageRecord(record), factors = imageRecord(record + 4u), light = imageRecord(record + 8u);
    HitChannels c =
        HitChannels(true, normal, uintBitsToFloat(factors.x), uintBitsToFloat(factors.y), uintBitsToFloat(light.xyz));
    bool hasSurface = images.y != 0u;
    while (hasSurface) {
        t.image = images.y;
        vec2 numbers = imageMean(t, p, true).yz;
        c.roughness *= numbers.x;
        c.metalness *= numbers.y;
        hasSurface = false;
    }
    bool hasNormals = images.x != 0u;
    while (hasNormals) {
        t.image = images.x;
        MappedNormal mapped = mappedNormal(normal, p.slope, imageMean(t, p, true).xyz, uintBitsToFloat(images.w));
        c.normal = normalize(mapped.normal - max(dot(mapped.normal, p.direction), 0.0) * p.direction);
        c.roughness = roughnessWithin(c.roughness, mapped.spread);
        hasNormals = false;
    }
    bool hasEmission = images.z != 0u;
    while (hasEmission) {
        t.image = images.z;
        t.factor = vec4(1.0);
        c.emission *= lightOfColour(imageColour(t, p).xyz);
        hasEmission = false;
    }
    return c;
}

// `normal`: of the surface, unit, towards the viewer.
HitChannels channelsAt(Hit hit, vec3 normal, vec3 direction) {
    HitChannels found = HitChannels(false, normal, 0.0, 0.0, vec3(0.0));
    bool hard = hit.depth < kNoHit && nodeType(hit.leaf) == kNodeHard;
    while (hard) {
        TableNode node = fetchTableNode(hit.record);
        bool hasPoints = (node.flags & kRecordHasPoints) != 0u;
        while (hasPoints) {
            uint vertices = fetchWord(node.pageTexel, kPageHeaderVertices);
            uint colours = fetchTableColours(hit.record).vertices;
            ImagePoint first = fetchImagePoint(colours, vertices, hit.corners.x);
            uvec4 material = uvec4(0u);
            if (first.material != 0u && first.material <= fetchImageWord(0u))
                material = imageRecord(4u * first.material);
            bool hasChannels = material.x != 0u && material.w != 0u;
            while (hasChannels) {
                uint corners = fetchTableSections(hit.record).vertices;
                uvec2 a = fetchPair(corners, hit.corners.x), b = fetchPair(corners, hit.corners.y),
                      c = fetchPair(corners, hit.corners.z);
                vec3 pa = decodeVertex(a.x, a.y), pb = decodeVertex(b.x, b.y), pc = decodeVertex(c.x, c.y);
                vec3 n = cross(pb - pa, pc - pa);
                n *= inversesqrt(max(dot(n, n), 1e-30));
                ImagedTriangle t = imagedTriangle(first, fetchImagePoint(colours, vertices, hit.corners.y),
                                                  fetchImagePoint(colours, vertices, hit.corners.z));
                ImagedPoint p = ImagedPoint(t.place + hit.at.x * t.toB + hit.at.y * t.toC,
                                            textureSlope(pa, pb, pc, t.toB, t.toC), n, direction, footprintEdge(hit));
                found = readChannels(material.w, t, p, normal);
                hasChannels = false;
            }
            hasPoints = false;
        }
        hard = false;
    }
    return found;
}
