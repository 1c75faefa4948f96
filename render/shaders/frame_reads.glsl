// What passes make of constants, pool and table, however these are bound.

// A light as FrameConstants::lightDirection has it, and its bits of the part of the light that is seen: the one light
// has all eight.
vec4 lightNumbered(uint number) { return number == 0u ? frame.lightDirection : frame.moreLights[number - 1u]; }
uint bitsOfLight(uint number) { return frame.lightCount == 1u ? 255u : 1u << number; }

uvec2 pictureSize() { return uvec2(frame.width, frame.height); }

// Returns a pixel's edge at a depth, in finest cells.
float pixelEdgeAt(float depth) { return frame.pixelEdge + frame.pixelEdgePerDepth * depth; }

// The parts of record `number` of the page table.
TableNode fetchTableNode(uint number) {
    uvec4 t = fetchTable(number * kRecordTexels);
    return TableNode(t.x, t.y, t.z, t.w);
}

TableSections fetchTableSections(uint number) {
    uvec4 t = fetchTable(number * kRecordTexels + 1u);
    return TableSections(t.x, t.y, t.z, t.w);
}

TableColours fetchTableColours(uint number) {
    uvec4 t = fetchTable(number * kRecordTexels + 2u);
    return TableColours(t.x, t.y, t.z, t.w);
}

bool hasOctant(TableNode record, uint octant) { return (record.flags >> octant & 1u) != 0u; }

// Number in the table of the child in an octant that has one.
uint childIn(TableNode record, uint octant) {
    return record.firstChild + bitCount(record.flags & ((1u << octant) - 1u));
}

// The two words of a record of 8 bytes.
uvec2 fetchPair(uint sectionTexel, uint i) {
    uvec4 texel = fetchTexel(sectionTexel + (i >> 1));
    return (i & 1u) == 0u ? texel.xy : texel.zw;
}
