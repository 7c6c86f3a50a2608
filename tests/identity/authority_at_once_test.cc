// One authority, several who use it at once.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <set>
#include <thread>

#include "tests/identity/forged.h"

namespace sixpoint::identity {
namespace {

namespace fs = std::filesystem;
using testing::Must;
using testing::Plant;
using testing::TemporaryFolder;
using testing::WishOf;

constexpr int kEach_count = 50;

// Each second one is taken back. True where all went well.
bool IssueAndRevoke(const fs::path& folder, const std::string& name) {
  auto authority = Authority::Open(folder);
  if (!authority.ok()) return false;
  for (int i = 0; i < kEach_count; ++i) {
    const auto credentials = authority->Issue(WishOf("machines/" + name + std::to_string(i)));
    if (!credentials.ok()) return false;
    if (i % 2 == 0 && !authority->Revoke(testing::SerialOf(*credentials)).ok()) return false;
  }
  return true;
}

void ExpectNothingLost(Plant* plant, std::size_t users) {
  const auto issued = Must(plant->authority().Issued());
  std::set<std::string> names;
  std::size_t revoked_count = 0;
  for (const IssuedCertificate& one : issued) {
    names.insert(one.identity.name);
    revoked_count += one.revoked_at.has_value() ? 1 : 0;
  }
  EXPECT_EQ(names.size(), users * kEach_count);
  EXPECT_EQ(revoked_count, users * kEach_count / 2);
  for (const auto& entry : fs::recursive_directory_iterator(plant->folder()))
    EXPECT_NE(entry.path().filename().string().rfind(".new-", 0), 0U) << entry.path();
}

TEST(AuthorityAtOnce, LosesNothingOfTwoProcesses) {
  Plant plant;
  std::vector<pid_t> children;
  for (const std::string name : {"a", "b"}) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) _exit(IssueAndRevoke(plant.folder(), name) ? 0 : 1);
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = -1;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  }
  ExpectNothingLost(&plant, 2);
}

TEST(AuthorityAtOnce, LosesNothingOfThreeThreads) {
  Plant plant;
  std::atomic<int> good_count{0};
  std::vector<std::thread> threads;
  for (const std::string name : {"a", "b", "c"})
    threads.emplace_back([&, name] { good_count += IssueAndRevoke(plant.folder(), name) ? 1 : 0; });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(good_count, 3);
  ExpectNothingLost(&plant, 3);
}

TEST(AuthorityAtOnce, IsMadeOnce) {
  for (int round = 0; round < 10; ++round) {
    const TemporaryFolder folder;
    std::atomic<int> made_count{0}, late_count{0};
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i) {
      threads.emplace_back([&] {
        const absl::Status made = Authority::Create(folder / "authority", "test");
        made_count += made.ok() ? 1 : 0;
        late_count += absl::IsAlreadyExists(made) ? 1 : 0;
      });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(made_count, 1);
    EXPECT_EQ(late_count, 3);
    EXPECT_TRUE(Must(Authority::Open(folder / "authority")).Issue(WishOf("machines/m1")).ok());
  }
}

// Killed wherever it happens to be: whoever holds a certificate is listed, and the authority goes on.
TEST(AuthorityAtOnce, ListsWhateverItHandedOutBeforeItWasKilled) {
  Plant plant;
  for (int round = 0; round < 10; ++round) {
    int handed_out[2];
    ASSERT_EQ(pipe(handed_out), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      auto authority = Authority::Open(plant.folder());
      while (authority.ok()) {
        const auto credentials = authority->Issue(WishOf("machines/m1"));
        if (!credentials.ok()) break;
        const std::string serial = testing::SerialOf(*credentials);
        if (write(handed_out[1], serial.data(), serial.size()) != 32) break;
        if (!authority->Revoke(serial).ok()) break;
      }
      _exit(1);
    }
    close(handed_out[1]);
    usleep(3'000 + 1'700 * static_cast<unsigned>(round));
    kill(child, SIGKILL);
    int status = -1;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status));
    std::set<std::string> listed;
    for (const IssuedCertificate& one : Must(plant.authority().Issued())) listed.insert(one.serial);
    char serial[32];
    while (read(handed_out[0], serial, sizeof serial) == 32)
      EXPECT_EQ(listed.count(std::string(serial, sizeof serial)), 1U);
    close(handed_out[0]);
    ASSERT_TRUE(plant.authority().Issue(WishOf("machines/m2")).ok());
  }
}

}  // namespace
}  // namespace sixpoint::identity
