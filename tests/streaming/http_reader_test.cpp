// Files behind a server of the tests' own: what is right is read, what is wrong is one clear line.
#include "streaming/http_reader.h"

#include <atomic>
#include <fstream>
#include <random>
#include <thread>

#include "streaming/http_exchange.h"
#include "streaming/page_source.h"
#include "tests/support/directory_files.h"
#include "tests/support/range_server.h"
#include "tests/support/test_files.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_trees.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

class HttpReaderTest : public testing::Test {
protected:
    HttpReaderTest() : folder_("vcp_http_test") {
        test::writeSphereFile(file(), 4);
        server_ = std::make_unique<test::RangeServer>(folder_.path());
    }
    void SetUp() override { ASSERT_TRUE(server_->runs()); }

    [[nodiscard]] fs::path file() const { return folder_ / "scan.vcp"; }
    [[nodiscard]] Result<std::shared_ptr<HttpReader>> open(const std::string& name,
                                                           const HttpOptions& options = {}) const {
        return HttpReader::open(server_->url(name), options);
    }
    /// One line that begins with the address and says `what`.
    static void expectError(const Error& error, const std::string& what) {
        EXPECT_TRUE(error.line().starts_with("http")) << error.line();
        EXPECT_NE(error.line().find(what), std::string::npos) << error.line();
        EXPECT_EQ(error.line().find('\n'), std::string::npos);
    }

    TestFolder folder_;
    std::unique_ptr<test::RangeServer> server_;
};

TEST_F(HttpReaderTest, EveryRangeIsThatOfTheFile) {
    const std::string content = contentOf(file());
    const auto reader = open("scan.vcp", {.firstBytes = 5000});
    ASSERT_TRUE(reader) << reader.error().line();
    EXPECT_EQ((*reader)->size(), content.size());
    std::mt19937_64 random(1);
    for (int i = 0; i < 60; ++i) {
        const size_t offset = random() % content.size(),
                     size = 1 + random() % std::min<size_t>(content.size() - offset, 20000);
        std::vector<std::byte> bytes(size);
        const auto read = (*reader)->read(offset, bytes);
        ASSERT_TRUE(read) << read.error().line();
        EXPECT_EQ(std::memcmp(bytes.data(), content.data() + offset, size), 0) << offset;
    }
    std::vector<std::byte> past(2);
    EXPECT_EQ((*reader)->read(content.size() - 1, past).error().code, ErrorCode::Io);
    EXPECT_TRUE((*reader)->read(content.size(), {}));
}

TEST_F(HttpReaderTest, TheFirstViewTakesTwoRequests) {
    for (const uint64_t firstBytes : {uint64_t{16384}, uint64_t{65536}}) {
        const auto reader = open("scan.vcp", {.firstBytes = firstBytes});
        ASSERT_TRUE(reader) << reader.error().line();
        const auto dataset = readDataset(**reader);
        ASSERT_TRUE(dataset) << dataset.error().line();
        ASSERT_GT(dataset->header.fileBytes, 100000u);
        const auto page = readPage(**reader, *dataset, 0, true);
        ASSERT_TRUE(page) << page.error().line();
        EXPECT_LE((*reader)->requests(), 2u);
        EXPECT_LT((*reader)->bytesReceived(), dataset->header.fileBytes);
    }
}

TEST_F(HttpReaderTest, TheFirstViewOfALargeFileTakesTwoRequestsToo) {
    Dataset tree = test::randomTree(1, 6, 0.7, 256);
    const std::vector<std::byte> bytes = test::directoryFile(tree);
    ASSERT_GT(tree.pages.blocks() * kBlockBytes, wholeDirectoryBytes(kLeadBytes));
    std::ofstream(folder_ / "large.vcp", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
    const auto reader = open("large.vcp");
    ASSERT_TRUE(reader) << reader.error().line();
    const auto dataset = readDatasetStart(**reader);
    ASSERT_TRUE(dataset) << dataset.error().line();
    std::vector<std::byte> root(tree.pages[0].colourOffset + tree.pages[0].colourStoredBytes - tree.pages[0].offset);
    ASSERT_TRUE((*reader)->read(tree.pages[0].offset, root));
    EXPECT_EQ((*reader)->requests(), 2u);
    EXPECT_LT((*reader)->bytesReceived(), kLeadBytes + root.size() + 4096);
    // A block that comes later is a request of its own.
    const FilePageSource source(*reader, std::make_shared<const Dataset>(*dataset));
    ASSERT_TRUE(source.read(Request::directoryBlock(dataset->pages.blocks() - 1), true));
    EXPECT_EQ((*reader)->requests(), 3u);
    EXPECT_EQ(readDataset(**reader)->pages.blocksKnown(), tree.pages.blocks());
}

TEST_F(HttpReaderTest, WithoutSeveralRangesInAnAnswerItTakesAFewMore) {
    const auto reader = open("scan.vcp?fault=nomulti", {.firstBytes = 16384});
    ASSERT_TRUE(reader) << reader.error().line();
    const auto dataset = readDataset(**reader);
    ASSERT_TRUE(dataset) << dataset.error().line();
    EXPECT_TRUE(readPage(**reader, *dataset, 0, true));
    EXPECT_LE((*reader)->requests(), 3u);
}

TEST_F(HttpReaderTest, VerifiesWholeFilesFromManyThreads) {
    const auto reader = open("scan.vcp");
    ASSERT_TRUE(reader) << reader.error().line();
    const auto dataset = readDataset(**reader);
    ASSERT_TRUE(dataset);
    std::atomic<uint64_t> next{0}, good{0};
    std::vector<std::thread> threads;
    for (int i = 0; i < 6; ++i)
        threads.emplace_back([&] {
            for (uint64_t page = next++; page < dataset->pages.size(); page = next++)
                good += readPage(**reader, *dataset, page, true).ok();
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(good, dataset->pages.size());
}

TEST_F(HttpReaderTest, WhatIsWrongAtOpeningIsOneClearLine) {
    const std::pair<const char*, const char*> cases[] = {
        {"none.vcp", "no such file on the server (status 404)"},
        {"scan.vcp?fault=status-403", "does not allow it (status 403)"},
        {"scan.vcp?fault=status-503", "status 503"},
        {"scan.vcp?fault=whole", "does not answer range requests"},
        {"scan.vcp?fault=shifted", "another range than was asked for"},
        {"scan.vcp?fault=unnamed", "another range than was asked for"},
        {"scan.vcp?fault=short", "ended before all its bytes"},
        {"scan.vcp?fault=long", "longer than what was asked for"},
        {"scan.vcp?fault=gzip", "encodes the file"},
        {"scan.vcp?fault=loop", "more than 5 redirects"},
        {"scan.vcp?fault=ftp", "protocol that is not allowed"},
        {"scan.vcp?fault=status-416", "empty or ends before"},
    };
    for (const auto& [name, what] : cases) {
        SCOPED_TRACE(name);
        const auto reader = open(name);
        ASSERT_FALSE(reader);
        expectError(reader.error(), what);
    }
    std::ofstream(folder_ / "empty.vcp");
    const auto empty = open("empty.vcp");
    ASSERT_FALSE(empty);
    expectError(empty.error(), "status 416");
    for (const auto& [url, what] : {std::pair("http://127.0.0.1:1/x.vcp", "no connection"),
                                    std::pair("http://no.such.name.invalid/x.vcp", "name is not known"),
                                    std::pair("http://", "is not an address")}) {
        const auto reader = HttpReader::open(url);
        ASSERT_FALSE(reader);
        expectError(reader.error(), what);
    }
}

TEST_F(HttpReaderTest, WhatGoesWrongLaterIsNoBytes) {
    const std::pair<const char*, const char*> cases[] = {
        {"shifted", "another range than was asked for"},
        {"short", "ended before"},
        {"long", "longer than"},
        {"whole", "does not answer range requests"},
        {"status-500", "answers with status 500"},
        {"unnamed", "another range"},
    };
    for (const auto& [fault, what] : cases) {
        SCOPED_TRACE(fault);
        const auto reader = open(std::string("scan.vcp?after=1&fault=") + fault, {.firstBytes = 1000});
        ASSERT_TRUE(reader) << reader.error().line();
        std::vector<std::byte> bytes(3000);
        const auto read = (*reader)->read(2000, bytes);
        ASSERT_FALSE(read);
        expectError(read.error(), what);
        EXPECT_EQ(read.error().byte, 2000u);
    }
}

TEST_F(HttpReaderTest, ASilentServerIsATimeOut) {
    const auto silent = open("scan.vcp?fault=silent", {.stallSeconds = 1});
    ASSERT_FALSE(silent);
    expectError(silent.error(), "time-out");
    EXPECT_EQ(silent.error().code, ErrorCode::Io);
}

TEST_F(HttpReaderTest, InterruptEndsAStalledRead) {
    const auto reader = open("scan.vcp?after=1&fault=stall", {.stallSeconds = 20, .firstBytes = 1000});
    ASSERT_TRUE(reader) << reader.error().line();
    std::atomic<bool> done{false};
    std::thread thread([&] {
        std::vector<std::byte> bytes(3000);
        EXPECT_EQ((*reader)->read(2000, bytes).error().code, ErrorCode::Cancelled);
        done = true;
    });
    while (!done) {
        (*reader)->interrupt();
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    thread.join();
}

TEST_F(HttpReaderTest, RedirectsAreFollowed) {
    const auto reader = open("scan.vcp?fault=redirect", {.firstBytes = 1000});
    ASSERT_TRUE(reader) << reader.error().line();
    EXPECT_TRUE(readDataset(**reader));
}

TEST_F(HttpReaderTest, AFileThatChangesIsNoticed) {
    for (const char* kind : {"scan.vcp", "scan.vcp?fault=weak", "scan.vcp?fault=untagged"}) {
        SCOPED_TRACE(kind);
        test::writeSphereFile(file(), 4);
        fs::last_write_time(file(), fs::file_time_type::clock::now() - std::chrono::hours(1));
        const auto reader = open(kind, {.firstBytes = 1000});
        ASSERT_TRUE(reader) << reader.error().line();
        std::vector<std::byte> bytes(3000);
        ASSERT_TRUE((*reader)->read(2000, bytes));
        // Without a tag or date its size still tells.
        test::writeSphereFile(file(), 4, 1.2);
        const auto read = (*reader)->read(2000, bytes);
        ASSERT_FALSE(read);
        expectError(read.error(), "changed while it was read");
        const uint64_t before = (*reader)->requests();
        EXPECT_FALSE((*reader)->read(2000, bytes));
        EXPECT_EQ((*reader)->requests(), before) << "it is not asked again";
    }
}

TEST_F(HttpReaderTest, TlsIsVerified) {
    const std::string key = (folder_ / "key.pem").string(), certificate = (folder_ / "certificate.pem").string();
    const std::string make =
        "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=test "
        "-addext subjectAltName=IP:127.0.0.1 -keyout " +
        key + " -out " + certificate + " 2>/dev/null";
    ASSERT_EQ(std::system(make.c_str()), 0) << "openssl makes no certificate";
    const test::RangeServer secure(folder_.path(), {certificate, key});
    ASSERT_TRUE(secure.runs());
    const auto distrusted = HttpReader::open(secure.url("scan.vcp"));
    ASSERT_FALSE(distrusted);
    expectError(distrusted.error(), "certificate is not trusted");
    const auto trusted = HttpReader::open(secure.url("scan.vcp"), {.caFile = certificate});
    ASSERT_TRUE(trusted) << trusted.error().line();
    EXPECT_TRUE(readDataset(**trusted));
    const auto noFile = HttpReader::open(secure.url("scan.vcp"), {.caFile = folder_ / "none.pem"});
    ASSERT_FALSE(noFile);
    expectError(noFile.error(), "certificate");
}

TEST(HttpExchange, ContentRange) {
    const auto good = parseContentRange("bytes 5-99/1234");
    ASSERT_TRUE(good);
    EXPECT_EQ(good->range, (ByteRange{5, 99}));
    EXPECT_EQ(good->fileBytes, 1234u);
    for (const char* bad :
         {"", "bytes", "bytes 5-99", "bytes 5-99/", "bytes 9-5/1234", "bytes 0-1234/1234", "bytes */1234",
          "bytes 0-1/*", "lines 0-1/9", "bytes 0-1/99999999999999999999", "bytes -1/9", "bytes 0-1/9 "})
        EXPECT_FALSE(parseContentRange(bad)) << bad;
}

TEST(HttpExchange, PartsOfABodyAndEveryDamage) {
    const std::string body =
        "\r\n--ab\r\nContent-Range: bytes 2-5/90\r\n\r\n--ab\r\n--ab\r\ncontent-range: bytes 88-89/90\r\nX: "
        "y\r\n\r\nzz\r\n--ab--\r\n";
    const auto parts = [](const std::string& text, const std::string& type = "multipart/byteranges; boundary=ab") {
        return parseBodyParts(std::as_bytes(std::span(text)), type);
    };
    const auto found = parts(body);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(found[0].range, (ByteRange{2, 5}));
    EXPECT_EQ(std::memcmp(found[0].bytes.data(), "--ab", 4), 0) << "the boundary may be in the bytes";
    EXPECT_EQ(found[1].bytes.size(), 2u);
    EXPECT_EQ(parts(body, "Multipart/ByteRanges; boundary=\"ab\"").size(), 2u);
    EXPECT_TRUE(parts(body, "application/octet-stream").empty());
    EXPECT_TRUE(parts(body, "multipart/byteranges").empty());
    for (size_t size = 0; size + 8 < body.size(); ++size) {
        const std::string cut = body.substr(0, size);
        EXPECT_TRUE(parts(cut).empty()) << size;
    }
    for (size_t at = 0; at < body.size(); ++at) {
        std::string damaged = body;
        damaged[at] ^= 1;
        for (const BodyPart& part : parts(damaged)) EXPECT_EQ(part.range.size(), part.bytes.size());
    }
}

}  // namespace
}  // namespace vcp
