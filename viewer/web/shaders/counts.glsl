// Browsers count no work.

void countHit(bool found) {}
