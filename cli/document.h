// YAML and JSON files read field by field. Every missing or odd field is noted by its path, and all are reported at once.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace sixpoint::cli {

// What was refused so far in one document.
class Problems {
 public:
  // strict: unknown keys are refused too (files that people write, where a key that nobody reads is a typing error).
  explicit Problems(bool strict) : strict_(strict) {}
  void Add(const std::string& path, const std::string& value, const std::string& wanted);
  bool strict() const { return strict_; }
  bool empty() const { return lines_.empty(); }
  // OK, or INVALID_ARGUMENT with one line for each problem (at most 20).
  absl::Status ToStatus() const;

 private:
  bool strict_;
  std::vector<std::string> lines_;
};

// One field of a document; reading it wrongly notes a problem and gives a harmless value. A missing field is noted once,
// by At; what lies below it stays silent. The document and the problems must outlive it.
class Field {
 public:
  Field(const nlohmann::json* value, std::string path, Problems* problems)
      : value_(value), path_(std::move(path)), problems_(problems) {}

  const std::string& path() const { return path_; }
  bool present() const { return value_ != nullptr; }

  Field At(const std::string& key) const;
  // Absent or null is no problem here.
  std::optional<Field> Find(const std::string& key) const;
  std::vector<Field> Items(std::size_t minimum_count, std::size_t maximum_count) const;
  std::vector<std::pair<std::string, Field>> Members(std::size_t minimum_count, std::size_t maximum_count) const;
  // In a strict document: any other key is a problem.
  void OnlyKeys(const std::vector<std::string>& keys) const;

  double Number(double minimum = -kGreatest, double maximum = kGreatest) const;
  double Positive(double maximum = kGreatest) const;
  std::int64_t Whole(std::int64_t minimum, std::int64_t maximum) const;
  bool Flag() const;
  // Not empty, at most 256 bytes, no control characters.
  std::string Text() const;
  // Lines of a block of text, with their ends: at most so many bytes, no other control characters.
  std::string Lines(std::size_t most_bytes) const;
  // [A-Za-z0-9._-], 1 to 64 characters.
  std::string Id() const;
  // One of these.
  std::string Choice(const std::vector<std::string>& choices) const;
  Eigen::Vector2d Vector2() const;
  Eigen::Vector3d Vector3() const;
  // Length 1 within 1e-6; given back normalised.
  Eigen::Vector3d Direction() const;
  Eigen::Vector3d DirectionOfAnyLength() const;  // people write [1, 1, 0]; made unit
  // 4 x 4, rows; last row 0 0 0 1, rotation orthonormal within 1e-6 and right-handed.
  Eigen::Matrix4d RigidTransform() const;
  // A relative path that stays inside its folder.
  std::string PathInside() const;

  void Refuse(const std::string& wanted) const;

  static constexpr double kGreatest = 1e9;

 private:
  const nlohmann::json* value_;
  std::string path_;
  Problems* problems_;
};

// Empty where there is no such field.
std::string TextAt(const Field& field, const std::string& key);

inline constexpr std::uint64_t kGreatestDocumentBytes = 64u << 20;

// The whole file; NOT_FOUND, or INVALID_ARGUMENT where it is longer than that.
absl::StatusOr<std::string> ReadFile(const std::string& path, std::uint64_t greatest_bytes);
// All or nothing: written beside, then renamed.
absl::Status WriteFile(const std::string& path, const std::string& content);

absl::StatusOr<nlohmann::json> ParseJson(const std::string& name, const std::string& text);
// Plain scalars that are JSON numbers, true or false become those; all else is text. Bounded in depth and size, aliases
// included.
absl::StatusOr<nlohmann::json> ParseYaml(const std::string& name, const std::string& text);
// By the ending of its name: .json, .yaml or .yml.
absl::StatusOr<nlohmann::json> LoadDocument(const std::string& path);

}  // namespace sixpoint::cli
