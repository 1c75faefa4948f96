// Tasks of oneTBB, run in the calling thread: an instance of WebAssembly has no other.
#pragma once

namespace tbb {

template <class Range, class Body>
void parallel_for(const Range& range, const Body& body) {
    body(range);
}

}  // namespace tbb
