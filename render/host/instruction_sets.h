// The instruction sets that lanes are compiled for. Comes before Highway's own headers.
//
// Left out are vectors of a length that is not known when compiling, and sets that gain nothing over another one. Where
// a processor has none of them, four lanes are emulated; the tests run them on every set.
#pragma once

#define HWY_BROKEN_EMU128 0
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
