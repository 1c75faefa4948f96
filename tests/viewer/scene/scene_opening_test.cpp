#include "viewer/scene/scene_opening.h"

#include <chrono>
#include <new>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>

namespace vcp {
namespace {

/// Opens a dataset, with `fail` called where the progress is told.
Error errorOf(const std::function<void()>& fail) {
    BuildOptions build;
    build.progress = [fail](const BuildProgress&) {
        fail();
        return true;
    };
    SceneOpening opening({"folder/none.vcp"}, build, {});
    while (!opening.isDone()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const auto opened = opening.take();
    EXPECT_FALSE(opened);
    return opened ? Error{} : opened.error();
}

TEST(SceneOpening, WhatItsThreadThrowsIsOneClearError) {
    const Error memory = errorOf([] { throw std::bad_alloc(); });
    EXPECT_EQ(memory.code, ErrorCode::Limit);
    EXPECT_EQ(memory.line(), "none.vcp: needs more memory than there is; close other programs, or give less at once");
    const Error unforeseen = errorOf([] { throw std::runtime_error("seven"); });
    EXPECT_EQ(unforeseen.code, ErrorCode::Unsupported);
    EXPECT_NE(unforeseen.line().find("seven"), std::string::npos) << unforeseen.line();
    EXPECT_EQ(errorOf([] {}).code, ErrorCode::Io) << "the file is not there";
}

}  // namespace
}  // namespace vcp
