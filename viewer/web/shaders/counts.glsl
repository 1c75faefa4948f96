// Browsers count no work.

void countHit(bool found) {}

void countWork(uint steps, uint fetches) {}
