#include "viewer/moving_size.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vcp {

double RecentFrames::least() const {
    return *std::min_element(ms_.begin(), ms_.begin() + long(std::min(taken_, ms_.size())));
}

void MovingSize::take(int reduction, double fullMs) {
    fullMs_.take(fullMs);
    calm_ = reduction == reduction_ && reductionFor(fullMs, kRoom * frameMs_) < reduction_ ? calm_ + 1 : 0;
}

void MovingSize::rest() {
    reduction_ = 1;
    calm_ = 0;
    patience_ = kPatience;
    hasTried_ = false;
}

int MovingSize::next(bool isNew) {
    if (frameMs_ <= 0 || !isNew || fullMs_.areNone()) return reduction_;
    const int wanted = reductionFor(fullMs_.least(), frameMs_);
    if (wanted > reduction_) {
        if (std::exchange(hasTried_, false)) patience_ *= 3;
        reduction_ = wanted;
    } else if (calm_ >= patience_) {
        hasTried_ = true;
        --reduction_;
    } else {
        return reduction_;
    }
    calm_ = 0;
    return reduction_;
}

int MovingSize::reductionFor(double fullMs, double frameMs) const {
    return int(std::clamp(std::ceil(std::sqrt(fullMs / frameMs)), 1.0, double(kMost)));
}

}  // namespace vcp
