// What a hostile or slow server can cost: time, bytes, memory. And what nobody but the server is told: passwords.
#include <atomic>
#include <chrono>
#include <thread>

#include "streaming/exchange_pace.h"
#include "streaming/http_reader.h"
#include "streaming/web_address.h"
#include "tests/support/range_server.h"
#include "tests/support/test_files.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

/// A server of a small scan.
class HttpLimits : public testing::Test {
protected:
    HttpLimits() : folder_("vcp_http_limits_test") {
        test::writeSphereFile(folder_ / "scan.vcp", 4);
        server_ = std::make_unique<test::RangeServer>(folder_.path());
    }
    void SetUp() override { ASSERT_TRUE(server_->runs()); }

    [[nodiscard]] Result<std::shared_ptr<HttpReader>> open(const std::string& fault,
                                                           const HttpOptions& options = {}) const {
        return HttpReader::open(server_->url("scan.vcp?fault=" + fault), options);
    }
    [[nodiscard]] std::string withUser(const std::string& user, const std::string& file) const {
        std::string url = server_->url(file);
        return url.insert(url.find("://") + 3, user + "@");
    }

    TestFolder folder_;
    std::unique_ptr<test::RangeServer> server_;
};

// Gives up early on servers that would take half a minute and more.
const HttpOptions kImpatient{.stallSeconds = 0.3, .leastBytesPerSecond = 10'000};

TEST_F(HttpLimits, SlowAnswersAreTimeOuts) {
    for (const char* fault : {"drip", "dripheader", "silent", "stall"}) {
        SCOPED_TRACE(fault);
        const auto slow = open(fault, kImpatient);
        ASSERT_FALSE(slow);
        EXPECT_EQ(slow.error().code, ErrorCode::Io);
        EXPECT_NE(slow.error().line().find("time-out"), std::string::npos) << slow.error().line();
    }
}

TEST_F(HttpLimits, ARedirectIsFollowedWhateverItsPage) {
    for (const char* fault : {"moved", "heavy"}) {
        SCOPED_TRACE(fault);
        const auto reader = open(fault);
        ASSERT_TRUE(reader) << reader.error().line();
        EXPECT_TRUE(readDataset(**reader));
    }
}

TEST_F(HttpLimits, WhatIsTooMuchIsOneClearLine) {
    const std::pair<const char*, const char*> cases[] = {
        {"headers", "more than 65536 bytes of header"}, {"hints", "more than 65536 bytes of header"},
        {"claims", "longer than what was asked for"},   {"missing", "no such file on the server (status 404)"},
        {"reset", "ended before all its bytes"},
    };
    for (const auto& [fault, what] : cases) {
        SCOPED_TRACE(fault);
        const auto reader = open(fault);
        ASSERT_FALSE(reader);
        EXPECT_NE(reader.error().line().find(what), std::string::npos) << reader.error().line();
    }
}

TEST_F(HttpLimits, FaultsThatBeginLaterAreNoBytes) {
    const std::pair<const char*, const char*> cases[] = {
        {"drip", "time-out"},
        {"dripheader", "time-out"},
        {"stall", "time-out"},
        {"headers", "bytes of header"},
        {"claims", "longer than"},
        {"missing", "no such file"},
        {"reset", "ended before all its bytes"},
        {"gzip", "encodes the file"},
        {"escape", "another range"},
    };
    for (const auto& [fault, what] : cases) {
        SCOPED_TRACE(fault);
        HttpOptions options = kImpatient;
        options.firstBytes = 1000;
        const auto reader = open(std::string(fault) + "&after=1", options);
        ASSERT_TRUE(reader) << reader.error().line();
        std::vector<std::byte> bytes(5000);
        const auto read = (*reader)->read(2000, bytes);
        ASSERT_FALSE(read);
        EXPECT_NE(read.error().line().find(what), std::string::npos) << read.error().line();
        EXPECT_EQ(read.error().byte, 2000u);
    }
}

TEST_F(HttpLimits, WhatIsQuotedOfAHeaderIsShort) {
    const auto reader = open("escape");
    ASSERT_FALSE(reader);
    EXPECT_NE(reader.error().message.find("another range than was asked for"), std::string::npos)
        << reader.error().message;
    EXPECT_LT(reader.error().message.size(), 150u);
}

TEST_F(HttpLimits, CancellingEndsEveryExchange) {
    for (const char* fault : {"drip", "dripheader", "silent", "stall", "hints", "headers"}) {
        SCOPED_TRACE(fault);
        // Nothing else would end it within the test's patience.
        std::atomic<int> asked{0};
        HttpOptions options{.connectSeconds = 1000, .stallSeconds = 1000, .headerBytes = uint64_t{1} << 40};
        options.cancelled = [&] { return ++asked > 3; };
        const auto reader = open(fault, options);
        ASSERT_FALSE(reader);
        EXPECT_EQ(reader.error().code, ErrorCode::Cancelled) << reader.error().line();
        EXPECT_EQ(asked, 4) << "it is not asked again";
    }
}

TEST_F(HttpLimits, CancellingEndsLaterReads) {
    std::atomic<bool> cancelled{false};
    HttpOptions options{.stallSeconds = 1000, .firstBytes = 1000};
    options.cancelled = [&] { return cancelled.load(); };
    const auto reader = open("stall&after=1", options);
    ASSERT_TRUE(reader) << reader.error().line();
    std::thread thread([&] {
        std::vector<std::byte> bytes(3000);
        EXPECT_EQ((*reader)->read(2000, bytes).error().code, ErrorCode::Cancelled);
    });
    cancelled = true;
    thread.join();
}

TEST_F(HttpLimits, APasswordGoesToTheServerAndNowhereElse) {
    const std::string url = withUser("user:se%2Fcret", "scan.vcp?fault=auth");
    const auto reader = HttpReader::open(url);
    ASSERT_TRUE(reader) << reader.error().line();
    EXPECT_TRUE(readDataset(**reader));
    EXPECT_EQ((*reader)->name(), withUser("***", "scan.vcp?fault=auth"));
    EXPECT_EQ((*reader)->identity().find("cret"), std::string::npos);
    std::vector<std::byte> past(2);
    EXPECT_EQ((*reader)->read((*reader)->size(), past).error().line().find("cret"), std::string::npos);
    for (const char* wrong : {"user:other-secret", "user:other/secret", "other-secret", ":other-secret"}) {
        const auto refused = HttpReader::open(withUser(wrong, "scan.vcp?fault=auth"));
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().line().find("secret"), std::string::npos) << refused.error().line();
        EXPECT_TRUE(refused.error().line().starts_with("http://***@127.0.0.1:")) << refused.error().line();
    }
}

TEST_F(HttpLimits, APasswordFollowsRedirectsToTheSameServerOnly) {
    const auto inside = HttpReader::open(withUser("user:se%2Fcret", "scan.vcp?fault=inside"));
    EXPECT_TRUE(inside) << inside.error().line();
    const auto away = HttpReader::open(withUser("user:se%2Fcret", "scan.vcp?fault=away"));
    ASSERT_FALSE(away);
    EXPECT_NE(away.error().line().find("status 401"), std::string::npos) << away.error().line();
}

TEST(ExchangePace, ASteadyTrickleFailsAndWhatIsFastEnoughGoesOn) {
    const HttpOptions options{.connectSeconds = 10, .stallSeconds = 10, .leastBytesPerSecond = 1000};
    for (const uint64_t perSecond : {0, 2, 999, 1000, 50'000}) {
        ExchangePace pace(options, 1'000'000, 0);
        std::optional<std::string> problem;
        double now = 0;
        for (; now < 500 && !problem; now += 0.25) problem = pace.problem(now, uint64_t(now * double(perSecond)), true);
        EXPECT_EQ(problem.has_value(), perSecond < 1000) << perSecond;
        EXPECT_TRUE(!problem || now < 11) << perSecond;
    }
}

TEST(ExchangePace, ABurstDoesNotPayForSilence) {
    ExchangePace pace({.connectSeconds = 10, .stallSeconds = 10, .leastBytesPerSecond = 1000}, 10'000'000, 0);
    EXPECT_FALSE(pace.problem(1, 9'000'000, true));
    EXPECT_FALSE(pace.problem(10, 9'000'000, true));
    const auto problem = pace.problem(20, 9'000'020, true);
    ASSERT_TRUE(problem);
    EXPECT_NE(problem->find("20 bytes in 10 s"), std::string::npos) << *problem;
}

TEST(ExchangePace, AllOfItHasAnEndThatFollowsFromItsBytes) {
    const HttpOptions options{.connectSeconds = 10, .stallSeconds = 10, .leastBytesPerSecond = 1000};
    ExchangePace pace(options, 64'000, 5);
    EXPECT_EQ(pace.mostSeconds(), 84);
    // Without a connection nothing else counts; header lines without end, fast as they come, do not help.
    EXPECT_FALSE(pace.problem(88, 0, false));
    EXPECT_TRUE(pace.problem(90, 0, false));
    EXPECT_TRUE(ExchangePace(options, 64'000, 5).problem(90, 1'000'000'000, true));
    EXPECT_EQ(ExchangePace({.leastBytesPerSecond = 0}, 10, 0).mostSeconds(), 30)
        << "a rate of nothing would have no end";
}

TEST(WebAddress, UserAndPasswordAreNotShown) {
    const std::pair<const char*, const char*> cases[] = {
        {"https://user:secret@host/x.vcp?token=1", "https://***@host/x.vcp?token=1"},
        {"HTTPS://secret@host", "HTTPS://***@host"},
        {"http://user:a@secret@host/x", "http://***@host/x"},
        {"http://user:sec/ret@host/x", "http://***@host/x"},
        {"http://user:sec?r#e/t@host", "http://***@host"},
        {"http://host:80/a@b.vcp", "http://host:80/a@b.vcp"},
        {"http://host/a@b.vcp?who=a@b", "http://host/a@b.vcp?who=a@b"},
        {"http://[::1]:80/a@b", "http://[::1]:80/a@b"},
        {"cannot open \"http://a:b@c/d\" or https://e:f@g", "cannot open \"http://***@c/d\" or https://***@g"},
        {"scan@home.vcp", "scan@home.vcp"},
        {"http://", "http://"},
        {"", ""},
    };
    for (const auto& [given, shown] : cases) EXPECT_EQ(shownAddress(given), shown);
    EXPECT_EQ(addressWithoutUser("https://user:secret@host/x?y=1"), "https://host/x?y=1");
    EXPECT_EQ(addressWithoutUser("a http://b@c"), "a http://b@c") << "a path is no address";
}

TEST(WebAddress, IsTakenApart) {
    const auto address = parseAddress("HTTPS://us%40er:se%2Fcret@Host.example/x%20y?z#f");
    ASSERT_TRUE(address);
    EXPECT_EQ(address->url, "https://Host.example/x%20y?z#f");
    EXPECT_EQ(address->origin, "https://host.example:443");
    EXPECT_EQ(address->user, "us@er");
    EXPECT_EQ(address->password, "se/cret");
    EXPECT_TRUE(address->isSecure());
    EXPECT_FALSE(parseAddress("http://host")->hasUser);
    for (const char* bad : {"", "http://", "ftp://host/x", "host/x", "http://user:sec/ret@host", "http://ho st/"})
        EXPECT_FALSE(parseAddress(bad)) << bad;
}

TEST(WebAddress, Redirected) {
    const auto from = parseAddress("https://user:secret@host:8443/a/b?c");
    ASSERT_TRUE(from);
    const auto to = [&](const char* location) { return redirected(*from, location); };
    EXPECT_EQ(to("/x")->url, "https://host:8443/x");
    EXPECT_EQ(to("x")->url, "https://host:8443/a/x");
    EXPECT_EQ(to("/x")->password, "secret");
    EXPECT_EQ(to("https://HOST:8443/x")->password, "secret");
    for (const char* other : {"//other/x", "https://host/x", "http://host:8443/x", "https://host.evil:8443/"})
        EXPECT_FALSE(to(other)->hasUser) << other;
    EXPECT_EQ(to("https://a:b@host:8443/")->password, "b");
    for (const char* bad : {"ftp://host/x", "file:///etc/passwd", "https://", "javascript:x"})
        EXPECT_FALSE(to(bad)) << bad;
}

}  // namespace
}  // namespace vcp
