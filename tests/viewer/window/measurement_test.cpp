#include "viewer/window/measurement.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace vcp {
namespace {

/// A right angle with legs 3 and 4, far from the origin.
Measurement rightAngle() {
    const glm::dvec3 corner(4.5e5, 5.2e6, 100);
    Measurement measurement;
    measurement.add({corner + glm::dvec3(3, 0, 0), 0.001, 5});
    measurement.add({corner, 0.002, 5});
    measurement.add({corner + glm::dvec3(0, 0, 4), 0.004, 4});
    return measurement;
}

TEST(Measurement, LengthsErrorsAndAngles) {
    const Measurement measurement = rightAngle();
    const MeasuredLine& line = measurement.lines().at(0);
    EXPECT_DOUBLE_EQ(segmentLength(line, 0), 3);
    EXPECT_DOUBLE_EQ(segmentLength(line, 1), 4);
    EXPECT_DOUBLE_EQ(lineLength(line), 7);
    EXPECT_DOUBLE_EQ(segmentError(line, 0), 0.003);
    EXPECT_DOUBLE_EQ(lineError(line), 0.009);
    EXPECT_DOUBLE_EQ(angleAt(line, 1), 90);
}

TEST(Measurement, ALineIsListedRowByRow) {
    std::vector<std::string> rows;
    for (const MeasuredText& row : measuredTexts(rightAngle().lines().at(0)))
        rows.push_back(row.what + " = " + row.value);
    EXPECT_EQ(rows, (std::vector<std::string>{"Point 1 +-0.001 = 450003.0000  5200000.0000  100.0000",
                                              "Point 2 +-0.002 = 450000.0000  5200000.0000  100.0000",
                                              "Distance 1 to 2 = 3.0000 +-0.003", "Angle at 2 = 90.00°",
                                              "Point 3 +-0.004 = 450000.0000  5200000.0000  104.0000",
                                              "Distance 2 to 3 = 4.0000 +-0.006", "Length = 7.0000 +-0.009"}));
}

TEST(Measurement, SmallAndFlatAnglesKeepTheirDigits) {
    for (const double angle : {1e-7, 1e-3, 1.0, 3.1415}) {
        const MeasuredLine line{{{1, 0, 0}}, {{0, 0, 0}}, {{std::cos(angle), std::sin(angle), 0}}};
        EXPECT_NEAR(angleAt(line, 1), angle * 180 / 3.14159265358979323846, 1e-12 + 1e-9 * angle);
    }
}

TEST(Measurement, LinesBeginAndPointsAreTakenBack) {
    Measurement measurement;
    measurement.takeBack();
    measurement.finishLine();
    EXPECT_TRUE(measurement.empty());
    measurement.add({{0, 0, 0}});
    measurement.add({{1, 0, 0}});
    measurement.finishLine();
    measurement.add({{2, 0, 0}});
    ASSERT_EQ(measurement.lines().size(), 2u);
    EXPECT_EQ(measurement.lines()[0].size(), 2u);
    measurement.takeBack();
    ASSERT_EQ(measurement.lines().size(), 1u);
    measurement.add({{3, 0, 0}});
    EXPECT_EQ(measurement.lines().size(), 2u) << "the first line was finished";
    measurement.takeBack();
    measurement.takeBack();
    measurement.add({{4, 0, 0}});
    ASSERT_EQ(measurement.lines().size(), 1u) << "a line that lost a point goes on";
    EXPECT_EQ(measurement.lines()[0].back().position.x, 4);
    measurement.clear();
    EXPECT_TRUE(measurement.empty());
}

TEST(Measurement, CsvHasARowAPoint) {
    const std::string csv = measurementCsv(rightAngle());
    EXPECT_EQ(csv,
              "line,point,x,y,z,error,level,segment,segment_error,total,angle_degrees\n"
              "1,1,450003,5200000,100,0.001,5,,,,\n"
              "1,2,450000,5200000,100,0.002,5,3,0.003,3,90\n"
              "1,3,450000,5200000,104,0.004,4,4,0.006,7,\n");
}

TEST(Measurement, JsonGivesBackEveryBit) {
    Measurement measurement;
    const glm::dvec3 odd(450000.12345678901, -1.0 / 3, 1e-300);
    measurement.add({odd, 0.1, 3});
    const auto json = nlohmann::json::parse(measurementJson(measurement));
    const auto& position = json["lines"][0]["points"][0]["position"];
    for (int i = 0; i < 3; ++i) EXPECT_EQ(position[size_t(i)].get<double>(), odd[i]);
    const auto angled = nlohmann::json::parse(measurementJson(rightAngle()));
    EXPECT_EQ(angled["lines"][0]["angles_degrees"], nlohmann::json::array({90.0}));
    EXPECT_EQ(angled["lines"][0]["length"], 7.0);
    EXPECT_EQ(angled["lines"][0]["points"][2]["level"], 4);
}

TEST(Measurement, AFileGivesBackWhatWasMeasured) {
    Measurement measurement = rightAngle();
    measurement.add({{450000.12345678901, -1.0 / 3, 1e-300}, 0.1, 3});
    const auto read = measurementFromJson(measurementJson(measurement, unitNamed("mm")), "m.json");
    ASSERT_TRUE(read) << read.error().line();
    EXPECT_EQ(read->unit, unitNamed("mm"));
    EXPECT_EQ(measurementJson(read->measurement, read->unit), measurementJson(measurement, unitNamed("mm")));
    const auto lines = annotatedLines(read->measurement, read->unit);
    ASSERT_EQ(lines.size(), measurement.lines().size());
    EXPECT_EQ(lines[0].lengths.size() + 1, lines[0].points.size());
    EXPECT_EQ(lines[0].lengths[0], lengthText(segmentLength(measurement.lines()[0], 0), unitNamed("mm")));
}

TEST(Measurement, FilesThatAreNoneAreRefused) {
    const std::pair<const char*, const char*> wrong[] = {
        {"", "breaks off"},
        {"{\"lines\": [", "breaks off"},
        {"[1]", "\"lines\" is missing"},
        {"{\"lines\": 3}", "\"lines\" is missing"},
        {"{\"lines\": [{}]}", "line 1 has no \"points\""},
        {"{\"lines\": [{\"points\": [{\"position\": [1, 2]}]}]}", "point 1 of line 1"},
        {"{\"lines\": [{\"points\": [{\"position\": [1, 2, \"x\"]}]}]}", "point 1 of line 1"},
        {"{\"unit\": \"ell\", \"lines\": []}", "\"unit\" is none of"},
    };
    for (const auto& [text, what] : wrong) {
        const auto read = measurementFromJson(text, "m.json");
        ASSERT_FALSE(read) << text;
        EXPECT_NE(read.error().line().find(what), std::string::npos) << read.error().line();
        EXPECT_NE(read.error().line().find("m.json"), std::string::npos);
    }
    EXPECT_FALSE(measurementFromJson(std::string(100000, '['), "m.json"));
}

TEST(Measurement, TextShowsTheDigitsThatTheErrorLeaves) {
    const std::string text = measurementText(rightAngle());
    EXPECT_NE(text.find("450003.0000  5200000.0000"), std::string::npos) << text;
    EXPECT_NE(text.find("distance 3.0000 +-0.003"), std::string::npos) << text;
    EXPECT_NE(text.find("angle 90.00 degrees"), std::string::npos) << text;
    EXPECT_NE(text.find("length 7.0000 +-0.009"), std::string::npos) << text;
}

// Two clicks on the same point: no angle, no NaN.
TEST(Measurement, PointsThatCoincideHaveNoAngle) {
    Measurement measurement;
    for (int i = 0; i < 3; ++i) measurement.add({{1, 2, 3}, 0.1, 0});
    for (const std::string& text :
         {measurementText(measurement), measurementCsv(measurement), measurementJson(measurement)})
        EXPECT_EQ(text.find("nan"), std::string::npos) << text;
}

}  // namespace
}  // namespace vcp
