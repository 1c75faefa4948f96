// Commands on datasets behind a server: a slow one can be left at once, and nobody is told its password.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <thread>

#include <gtest/gtest.h>

#include "octree/page_reader.h"
#include "streaming/http_reader.h"
#include "streaming/shard/shard_folder.h"
#include "tests/support/range_server.h"
#include "tests/support/test_files.h"
#include "tests/support/test_folder.h"
#include "tests/support/vcp_program.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {
namespace {

class Servers : public testing::Test {
protected:
    Servers() : folder_("vcp_servers_test"), vcp_(folder_) {
        test::writeSphereFile(folder_ / "scan.vcp", 4);
        server_ = std::make_unique<test::RangeServer>(folder_.path());
    }
    void SetUp() override { ASSERT_TRUE(server_->runs()); }

    [[nodiscard]] std::string withUser(const std::string& file) const {
        std::string url = server_->url(file);
        return url.insert(url.find("://") + 3, "user:se%2Fcret@");
    }
    /// Until the server has been asked for a file.
    void waitForRequest() const {
        for (int i = 0; i < 3000 && logged().empty(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
        ASSERT_FALSE(logged().empty());
    }
    [[nodiscard]] std::string logged() const { return contentOf(folder_ / "asked"); }

    TestFolder folder_;
    VcpProgram vcp_;
    std::unique_ptr<test::RangeServer> server_;
};

TEST_F(Servers, EverySignalEndsACommandThatWaitsForASlowServer) {
    const std::string url = server_->url("scan.vcp?fault=silent&log=1"), picture = (folder_ / "x.png").string();
    const std::pair<std::vector<std::string>, int> cases[] = {
        {{"info", url}, SIGINT},
        {{"info", url}, SIGHUP},
        {{"verify", url}, SIGTERM},
        {{"render", url, "-o", picture, "--device", "host"}, SIGINT},
        {{"stress", url, "--device", "host"}, SIGTERM},
        {{"bench", "stream", url, "--device", "host"}, SIGINT},
    };
    for (const auto& [arguments, signal] : cases) {
        SCOPED_TRACE(arguments.front());
        std::filesystem::remove(folder_ / "asked");
        const pid_t child = vcp_.start(arguments);
        waitForRequest();
        ::kill(child, signal);
        const Ran ran = vcp_.wait(child);
        // After a time-out it would say so.
        EXPECT_EQ(ran.status, 1) << ran.err;
        EXPECT_NE(ran.err.find("cancelled"), std::string::npos) << ran.err;
    }
}

TEST_F(Servers, AnOpeningEndsWhenItIsCancelledOrDestroyed) {
    SourceAccess access;
    for (const bool isCancelled : {true, false}) {
        std::filesystem::remove(folder_ / "asked");
        SceneOpening opening({server_->url("scan.vcp?fault=silent&log=1")}, {}, access);
        waitForRequest();
        if (!isCancelled) continue;  // destroyed
        opening.cancel();
        while (!opening.isDone()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        EXPECT_EQ(opening.take().error().code, ErrorCode::Cancelled);
    }
}

TEST_F(Servers, ShardsAreReadFromBesideTheirManifest) {
    const auto whole = *openFile(folder_ / "scan.vcp");
    const auto written = writeShards(*whole, {.folder = folder_ / "shards", .shardBytes = whole->size() / 6});
    ASSERT_TRUE(written.ok()) << written.error().line();
    ASSERT_GT(written->shards, 4u);
    const test::RangeServer server(folder_ / "shards");
    const auto requests = [&] {
        const std::string text = contentOf(folder_ / "shards/asked");
        return std::count(text.begin(), text.end(), '\n');
    };
    const auto reader = openReader(server.url("manifest.vcps?log=all"), {});
    ASSERT_TRUE(reader.ok()) << reader.error().line();
    const auto dataset = readDatasetStart(**reader);
    ASSERT_TRUE(dataset.ok()) << dataset.error().line();
    ASSERT_TRUE(readPage(**reader, *dataset, 0, true).ok());
    EXPECT_LE(requests(), 3);
    std::vector<std::byte> bytes(whole->size()), expected(whole->size());
    ASSERT_TRUE((*reader)->read(0, bytes).ok());
    ASSERT_TRUE(whole->read(0, expected).ok());
    EXPECT_TRUE(bytes == expected);
    EXPECT_GE(requests(), int64_t(written->shards));
}

TEST_F(Servers, WhatWasOpenedIsReadAfterItsOpeningIsGone) {
    auto opening =
        std::make_unique<SceneOpening>(std::vector{server_->url("scan.vcp")}, BuildOptions{}, SourceAccess{});
    while (!opening->isDone()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const auto open = opening->take();
    opening.reset();
    ASSERT_TRUE(open) << open.error().line();
    const OpenDataset& dataset = open->parts.front().open;
    const auto page = dataset.source->read(dataset.dataset->pages.size() - 1, true);
    EXPECT_TRUE(page) << page.error().line();
}

TEST_F(Servers, NoCommandSaysThePassword) {
    const std::string good = withUser("scan.vcp?fault=auth"), none = withUser("none.vcp"),
                      picture = (folder_ / "x.png").string();
    for (const std::vector<std::string>& arguments :
         std::initializer_list<std::vector<std::string>>{{"info", good},
                                                         {"info", good, "--json"},
                                                         {"info", none},
                                                         {"verify", good},
                                                         {"verify", none, "--json"},
                                                         {"render", none, "-o", picture},
                                                         {"stress", none},
                                                         {"info", good, none},
                                                         {"info", "http://user:secret"},
                                                         {"info", "http://user:se/cret@host"},
                                                         {"info", good, "--no-such-option=" + good}}) {
        SCOPED_TRACE(arguments.front());
        const Ran ran = vcp_.run(arguments);
        EXPECT_EQ((ran.out + ran.err).find("cret@"), std::string::npos) << ran.out << ran.err;
        EXPECT_EQ((ran.out + ran.err).find("se%2Fcret"), std::string::npos) << ran.out << ran.err;
    }
    const Ran info = vcp_.run({"info", good});
    EXPECT_EQ(info.status, 0) << info.err;
    EXPECT_TRUE(info.out.starts_with("http://***@127.0.0.1:")) << info.out;
    EXPECT_EQ(nameOf({"https://user:secret@host"}), "***@host");
    EXPECT_EQ(nameOf({"https://user:secret@host/a/x.vcp"}), "x.vcp");
}

}  // namespace
}  // namespace vcp
