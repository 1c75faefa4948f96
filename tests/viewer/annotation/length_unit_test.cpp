// Lengths as text, with units.
#include "viewer/annotation/length_unit.h"

#include <tuple>

#include <gtest/gtest.h>

namespace vcp {
namespace {

TEST(LengthUnit, LengthsAreWrittenInTheWorldsUnitOrInOneThatReadsBetter) {
    const std::tuple<double, const char*, const char*> cases[] = {
        {12.3456, "mm", "12.35 mm"}, {9999, "mm", "9999 mm"}, {25000, "mm", "25 m"},    {2.5e7, "mm", "25 km"},
        {0.002, "mm", "2 µm"},       {0.25, "cm", "0.25 cm"}, {0.005, "cm", "50 µm"},   {3e-9, "m", "0.003 µm"},
        {0.0004, "km", "400 mm"},    {0, "mm", "0 mm"},       {50000, "ft", "5e+04 ft"}};
    for (const auto& [length, unit, text] : cases) EXPECT_EQ(lengthText(length, unitNamed(unit)), text);
    EXPECT_EQ(lengthText(25000, {}), "2.5e+04");
    EXPECT_FALSE(unitNamed("furlong"));
}

// Powers of ten may round down to just below one.
TEST(LengthUnit, AWholeMetreIsNoThousandMillimetres) {
    EXPECT_EQ(lengthText(1e-3, unitNamed("km")), "1 m");
    EXPECT_EQ(lengthText(1e6, unitNamed("um")), "1 m");
    // The micro sign and the Greek letter are the same unit, whose name for programs is plain.
    for (const char* name : {"um", "\u00b5m", "\u03bcm"}) {
        ASSERT_TRUE(unitNamed(name)) << name;
        EXPECT_EQ(unitNamed(name)->name, "um");
        EXPECT_EQ(lengthText(3, unitNamed(name)), "3 \u00b5m");
    }
}

}  // namespace
}  // namespace vcp
