// What pictures are like while the camera moves: as large, and with as much light, as a frame's time allows.
#pragma once

#include <array>
#include <cstddef>

namespace vcp {

/// What the last frames of a kind took, three at most: one that is slow by itself does not show in the least.
class RecentFrames {
public:
    void take(double ms) { ms_[taken_++ % ms_.size()] = ms; }
    [[nodiscard]] bool areNone() const { return taken_ == 0; }
    /// Precondition: there are some.
    [[nodiscard]] double least() const;

private:
    std::array<double, 3> ms_{};
    size_t taken_ = 0;
};

/// Decides from frame to frame by how much the width and the height of moving pictures are reduced. A slow frame by
/// itself changes nothing; pictures become smaller where three in a row were too slow, and larger where that may do
/// after many in a row. Where that was in vain, the next attempt waits three times as long: sizes must not flicker.
class MovingSize {
public:
    static constexpr int kMost = 8;

    /// `frameMs`: what a frame may take; 0: pictures are never reduced.
    explicit MovingSize(double frameMs) : frameMs_(frameMs) {}

    /// Takes in a frame whose width and height were divided by `reduction`. `fullMs`: what it would have taken at full
    /// size, if time were in proportion to pixels. It is less: so this is too much for all larger pictures.
    void take(int reduction, double fullMs);
    /// The camera rests: the next motion begins with what a frame at full size took.
    void rest();
    /// Returns the reduction of the next moving picture, 1 to kMost. `isNew`: the camera has moved on since the last
    /// one; else its size stays.
    int next(bool isNew);

private:
    static constexpr int kPatience = 10;
    static constexpr double kRoom = 1.2;  // of the time, that a larger picture may seem to take: it takes less

    [[nodiscard]] int reductionFor(double fullMs, double frameMs) const;

    double frameMs_;
    RecentFrames fullMs_;
    int reduction_ = 1;
    int calm_ = 0;              // frames in a row after which a larger one may do
    int patience_ = kPatience;  // so many make pictures larger
    bool hasTried_ = false;     // pictures were made larger last
};

/// Decides whether moving pictures keep ambient occlusion: where pictures with it, at rest and in motion, take no more
/// than a part of a frame's time. One that is slow by itself changes nothing. Where motion has lost it, it comes back
/// at rest.
class MovingOcclusion {
public:
    /// `frameMs`: what a frame may take; 0: moving pictures have no occlusion.
    explicit MovingOcclusion(double frameMs) : mostMs_(kPart * frameMs) {}

    /// Takes in a frame with occlusion. `fullMs`: as in MovingSize::take.
    void take(double fullMs) { fullMs_.take(fullMs); }
    [[nodiscard]] bool keeps() const { return !fullMs_.areNone() && fullMs_.least() <= mostMs_; }

private:
    static constexpr double kPart = 0.6;

    double mostMs_;
    RecentFrames fullMs_;  // with occlusion
};

}  // namespace vcp
