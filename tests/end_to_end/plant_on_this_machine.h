// A plant as `sixpoint up` starts it, in a folder of the test's own.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

namespace sixpoint::testing {

class PlantOnThisMachine : public ::testing::Test {
 protected:
  struct Answer {
    int exit_code = -1;
    std::string text;  // stdout and stderr
  };

  void SetUp() override;
  void TearDown() override;

  std::string data() const { return (folder_ / "plant").string(); }
  std::string At(const std::string& host) const { return host + ":" + std::to_string(port_); }
  // `sixpoint` with these words.
  Answer Run(std::vector<std::string> words);
  // `sixpoint up` on data() and port_.
  Answer Up(std::vector<std::string> options = {});
  // `supervisorctl` with these words; its output.
  std::string Order(const std::string& words);
  // Of a program, as its supervisor knows it.
  std::string Pid(const std::string& program) { return Order("pid " + program); }
  // One value from the plant's database, by its owner.
  std::string Sql(const std::string& statement);

  std::filesystem::path folder_;
  int port_ = 0;

 private:
  int run_count_ = 0;
};

// What a shell prints; standard error too.
std::string ShellOutput(const std::string& command);
// The same of the user whom the plant's processes run as.
std::string ServiceShellOutput(const std::string& command);

}  // namespace sixpoint::testing
