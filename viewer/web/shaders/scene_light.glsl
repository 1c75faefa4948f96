// Browsers show one dataset: there is no light of several.

float sceneDepth(uint pixel) { return kNoHit; }

float sceneSkyAbout(uvec2 pixel, uvec2 size, float depth, float reach) { return 1.0; }

uint sceneLightAt(uint pixel) { return 255u; }

void storeScenePicture(uint pixel, uint colour) {}
