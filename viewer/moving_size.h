// What pictures are like while the camera moves: as large, and with as much light, as a frame's time allows.
#pragma once

#include <array>
#include <cstddef>

namespace vcp {

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
    static constexpr size_t kRemembered = 3;
    static constexpr int kPatience = 10;
    static constexpr double kRoom = 1.2;  // of the time, that a larger picture may seem to take: it takes less

    [[nodiscard]] int reductionFor(double fullMs, double frameMs) const;

    double frameMs_;
    std::array<double, kRemembered> fullMs_{};  // of the last frames
    size_t frames_ = 0;
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
    void take(double fullMs) { fullMs_[frames_++ % kRemembered] = fullMs; }
    [[nodiscard]] bool keeps() const;

private:
    static constexpr size_t kRemembered = 3;
    static constexpr double kPart = 0.6;

    double mostMs_;
    std::array<double, kRemembered> fullMs_{};  // of the last frames with occlusion
    size_t frames_ = 0;
};

}  // namespace vcp
