// Numbers of several rays, corners or triangles at once, with the operators that octree/shared/ray_field.h is written
// in. Compiled once for each instruction set (Highway's foreach_target.h).
#if defined(VCP_RENDER_HOST_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_LANES_INL_H
#undef VCP_RENDER_HOST_LANES_INL_H
#else
#define VCP_RENDER_HOST_LANES_INL_H
#endif

#include <hwy/highway.h>

#include <bit>
#include <cstdint>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 8>;
using Words = hn::RebindToUnsigned<Floats>;
using Integers = hn::RebindToSigned<Floats>;
using Mask = hn::Mask<Floats>;
using LaneWords = hn::Vec<Words>;
constexpr int kLanes = int(hn::MaxLanes(Floats()));
static_assert(kLanes == 4 || kLanes == 8);

/// One number a lane.
struct Lane {
    hn::Vec<Floats> v;

    Lane() = default;
    HWY_INLINE Lane(hn::Vec<Floats> lanes) : v(lanes) {}
    HWY_INLINE Lane(float x) : v(hn::Set(Floats(), x)) {}
    HWY_INLINE Lane(double x) : v(hn::Set(Floats(), float(x))) {}
};
HWY_INLINE Lane operator+(Lane a, Lane b) { return hn::Add(a.v, b.v); }
HWY_INLINE Lane operator-(Lane a, Lane b) { return hn::Sub(a.v, b.v); }
HWY_INLINE Lane operator-(Lane a) { return hn::Neg(a.v); }
HWY_INLINE Lane operator*(Lane a, Lane b) { return hn::Mul(a.v, b.v); }
HWY_INLINE Lane operator/(Lane a, Lane b) { return hn::Div(a.v, b.v); }
HWY_INLINE Mask operator==(Lane a, Lane b) { return hn::Eq(a.v, b.v); }
HWY_INLINE Mask operator<(Lane a, Lane b) { return hn::Lt(a.v, b.v); }
HWY_INLINE Mask operator<=(Lane a, Lane b) { return hn::Le(a.v, b.v); }
HWY_INLINE Mask operator>(Lane a, Lane b) { return hn::Gt(a.v, b.v); }
HWY_INLINE Mask operator>=(Lane a, Lane b) { return hn::Ge(a.v, b.v); }
HWY_INLINE Lane min(Lane a, Lane b) { return hn::Min(a.v, b.v); }
HWY_INLINE Lane max(Lane a, Lane b) { return hn::Max(a.v, b.v); }
HWY_INLINE Lane abs(Lane a) { return hn::Abs(a.v); }
HWY_INLINE Lane sqrt(Lane a) { return hn::Sqrt(a.v); }
/// Returns a b + c, rounded once where the machine can.
HWY_INLINE Lane mulAdd(Lane a, Lane b, Lane c) { return hn::MulAdd(a.v, b.v, c.v); }
/// Returns a b - c.
HWY_INLINE Lane mulSub(Lane a, Lane b, Lane c) { return hn::MulSub(a.v, b.v, c.v); }
HWY_INLINE Lane select(Mask mask, Lane yes, Lane no) { return hn::IfThenElse(mask, yes.v, no.v); }

HWY_INLINE Lane load(const float* aligned) { return hn::Load(Floats(), aligned); }
HWY_INLINE void store(Lane a, float* aligned) { hn::Store(a.v, Floats(), aligned); }
HWY_INLINE LaneWords gather(const uint32_t* words, LaneWords index) {
    return hn::GatherIndex(Words(), words, hn::BitCast(Integers(), index));
}
HWY_INLINE Lane gatherFloats(const float* numbers, LaneWords index) {
    return hn::GatherIndex(Floats(), numbers, hn::BitCast(Integers(), index));
}
/// Converts integers with a sign.
HWY_INLINE Lane toFloats(LaneWords words) { return hn::ConvertTo(Floats(), hn::BitCast(Integers(), words)); }

HWY_INLINE Mask operator&(Mask a, Mask b) { return hn::And(a, b); }
HWY_INLINE Mask operator|(Mask a, Mask b) { return hn::Or(a, b); }
HWY_INLINE Mask operator^(Mask a, Mask b) { return hn::Xor(a, b); }
/// a and not b.
HWY_INLINE Mask without(Mask a, Mask b) { return hn::AndNot(b, a); }
HWY_INLINE bool any(Mask mask) { return !hn::AllFalse(Floats(), mask); }
/// Bit i: lane i.
HWY_INLINE uint32_t bitsOf(Mask mask) {
    uint8_t bits[8];
    hn::StoreMaskBits(Floats(), mask, bits);
    return bits[0];
}
HWY_INLINE Mask maskOf(uint32_t bits) {
    const uint8_t bytes[8] = {uint8_t(bits)};
    return hn::LoadMaskBits(Floats(), bytes);
}

/// Vectors of two to four lanes, as glm has them of numbers.
struct Lane2 {
    Lane x, y;
    Lane2() = default;
    HWY_INLINE Lane2(Lane a, Lane b) : x(a), y(b) {}
};
struct Lane3 {
    Lane x, y, z;
    Lane3() = default;
    HWY_INLINE Lane3(Lane a, Lane b, Lane c) : x(a), y(b), z(c) {}
};
struct Lane4 {
    Lane x, y, z, w;
    Lane4() = default;
    HWY_INLINE Lane4(Lane a, Lane b, Lane c, Lane d) : x(a), y(b), z(c), w(d) {}
};
HWY_INLINE Lane3 spread(glm::dvec3 v) { return {Lane(float(v.x)), Lane(float(v.y)), Lane(float(v.z))}; }
HWY_INLINE Lane3 spread(glm::vec3 v) { return {Lane(v.x), Lane(v.y), Lane(v.z)}; }
HWY_INLINE Lane3 spread(glm::vec4 v) { return {Lane(v.x), Lane(v.y), Lane(v.z)}; }
HWY_INLINE Lane2 operator+(Lane2 a, Lane2 b) { return {a.x + b.x, a.y + b.y}; }
HWY_INLINE Lane2 operator*(Lane2 a, Lane2 b) { return {a.x * b.x, a.y * b.y}; }
HWY_INLINE Lane2 operator*(Lane a, Lane2 b) { return {a * b.x, a * b.y}; }
HWY_INLINE Lane2 operator/(Lane2 a, Lane2 b) { return {a.x / b.x, a.y / b.y}; }
HWY_INLINE Lane2 operator-(Lane2 a, Lane2 b) { return {a.x - b.x, a.y - b.y}; }
HWY_INLINE Lane3 loadLanes(const float (&numbers)[3][8]) {
    return {load(numbers[0]), load(numbers[1]), load(numbers[2])};
}
HWY_INLINE void storeLanes(Lane3 v, float (&numbers)[3][8]) {
    store(v.x, numbers[0]), store(v.y, numbers[1]), store(v.z, numbers[2]);
}
HWY_INLINE Lane3 operator+(Lane3 a, Lane3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
HWY_INLINE Lane3 operator-(Lane3 a, Lane3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
HWY_INLINE Lane3 operator-(Lane3 a) { return {-a.x, -a.y, -a.z}; }
HWY_INLINE Lane3 operator*(Lane a, Lane3 b) { return {a * b.x, a * b.y, a * b.z}; }
HWY_INLINE Lane3 operator*(Lane3 a, Lane3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
HWY_INLINE Lane4 operator+(Lane4 a, Lane4 b) { return {a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w}; }
HWY_INLINE Lane4 operator-(Lane4 a, Lane4 b) { return {a.x - b.x, a.y - b.y, a.z - b.z, a.w - b.w}; }
HWY_INLINE Lane4 operator*(Lane4 a, Lane4 b) { return {a.x * b.x, a.y * b.y, a.z * b.z, a.w * b.w}; }
HWY_INLINE Lane dot(Lane3 a, Lane3 b) { return mulAdd(a.x, b.x, mulAdd(a.y, b.y, a.z * b.z)); }
HWY_INLINE Lane dot(Lane4 a, Lane4 b) { return mulAdd(a.x, b.x, mulAdd(a.y, b.y, mulAdd(a.z, b.z, a.w * b.w))); }
HWY_INLINE Lane3 mulAdd(Lane a, Lane3 b, Lane3 c) {
    return {mulAdd(a, b.x, c.x), mulAdd(a, b.y, c.y), mulAdd(a, b.z, c.z)};
}
HWY_INLINE Lane3 cross(Lane3 a, Lane3 b) {
    return {mulSub(a.y, b.z, a.z * b.y), mulSub(a.z, b.x, a.x * b.z), mulSub(a.x, b.y, a.y * b.x)};
}
HWY_INLINE Lane2 select(Mask mask, Lane2 yes, Lane2 no) {
    return {select(mask, yes.x, no.x), select(mask, yes.y, no.y)};
}
HWY_INLINE Lane3 select(Mask mask, Lane3 yes, Lane3 no) {
    return {select(mask, yes.x, no.x), select(mask, yes.y, no.y), select(mask, yes.z, no.z)};
}

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
