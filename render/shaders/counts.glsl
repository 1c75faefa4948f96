// The counters of a frame's passes that trace rays; needs GL_KHR_shader_subgroup_ballot.

// Counts the pixels of those rays in lock step that hit something.
void countHit(bool found) {
    uint hitCount = subgroupBallotBitCount(subgroupBallot(found));
    if (subgroupElect()) atomicAdd(counters.hitPixels, hitCount);
}
