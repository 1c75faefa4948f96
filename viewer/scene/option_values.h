// Parses values of command-line options, and formats numbers for people. Pure text; no I/O.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "viewer/camera/orbit_camera.h"

namespace vcp {

/// A length: world units ("0.25", "1e-3"), or a part of the bounding box's diagonal ("0.01%").
struct Length {
    double value = 0;         ///< world units, or a fraction (0.01% is 1e-4)
    bool isRelative = false;  ///< `value` is a part of the diagonal
};

/// Parses a length. Returns nothing when the text is not a positive, finite length.
std::optional<Length> parseLength(std::string_view text);

/// Parses "4096", "512K", "512M", "4G", "1T", also with "iB" or "B" behind; factors of 1024. Returns nothing when
/// malformed, zero, or beyond 2^60.
std::optional<uint64_t> parseBytes(std::string_view text);
/// Parses the same, of at least 1 MiB: the pool or memory.
std::optional<uint64_t> parseBudget(std::string_view text);

/// Parses as parseBytes, or a part of `whole`: "50%".
std::optional<uint64_t> parseMemory(std::string_view text, uint64_t whole);

/// Parses "10000", "250k", "1.5M", "1G": a whole number, with factors of 1000. Returns nothing when malformed, zero,
/// beyond 10^15, or not whole.
std::optional<uint64_t> parseCount(std::string_view text);

constexpr int kLargestSize = 16384;
/// Parses "1920x1200": each from 1 to kLargestSize.
std::optional<glm::ivec2> parseSize(std::string_view text);

/// Parses finite numbers with commas between, such as "30,35.5". Returns none when malformed.
std::vector<double> parseNumbers(std::string_view text);

/// A plane that cuts: what has dot(normal, x) >= offset is kept.
struct PlaneChoice {
    glm::dvec3 normal{0};
    double offset = 0;        ///< world units, or a part of the bounding box along its axis
    bool isRelative = false;  ///< then the normal is an axis
};

/// Parses what to keep: "x<0.2", "z>50%" (of the bounding box), or four numbers "a,b,c,d" for ax + by + cz >= d.
/// Returns nothing when malformed.
std::optional<PlaneChoice> parsePlane(std::string_view text);

/// Returns the offset of a plane in world units, in a box.
double offsetIn(const PlaneChoice& plane, const Box& bounds);

/// Parses two corners, "x,y,z,x,y,z", each of the first below its other. Returns nothing when malformed.
std::optional<Box> parseBox(std::string_view text);

/// Parses three numbers, "1,0,-0.5", not all zero. Returns nothing when malformed.
std::optional<glm::dvec3> parseDirection(std::string_view text);

/// Returns a text such as "1 087 716".
std::string formatCount(uint64_t count);

/// Returns a text such as "1 line" or "12 lines"; `many` where an s does not make it.
std::string formatCount(uint64_t count, std::string_view one, std::string_view many = {});

/// Returns a text such as "13.2 MB", in powers of 1000 as file managers show it.
std::string formatBytes(uint64_t bytes);

/// Returns up to 4 significant digits: "0.01234", "1.5e-07".
std::string formatLength(double length);

/// Returns a text such as "0.82 s" or "3 min 05 s".
std::string formatSeconds(double seconds);

/// Returns about how long work goes on that came from the fraction `begun` to `fraction` in so many seconds; nothing in
/// its first moments, which say little about the rest.
std::optional<double> secondsLeft(double seconds, double fraction, double begun = 0);

/// Returns such a time as a text: it is no more than a guess of whole seconds.
std::string formatTimeLeft(double seconds);

}  // namespace vcp
