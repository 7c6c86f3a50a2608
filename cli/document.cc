#include "cli/document.h"

#include <yaml-cpp/yaml.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>

#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::cli {
namespace {

constexpr std::size_t kGreatestProblemCount = 20;
constexpr int kGreatestDepth = 32;
constexpr int kGreatestNodeCount = 2000000;

std::string Shown(const nlohmann::json& value) {
  std::string text = value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

bool IsIdCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' || c == '-';
}

// Every alias is walked again, so the count bounds what a small hostile file can grow to.
absl::Status Convert(const std::string& name, const YAML::Node& node, int depth, int* node_count, nlohmann::json* out) {
  if (depth > kGreatestDepth || ++*node_count > kGreatestNodeCount) {
    return absl::InvalidArgumentError(name + ": nested deeper than " + std::to_string(kGreatestDepth) +
                                      " or longer than " + std::to_string(kGreatestNodeCount) + " values");
  }
  if (node.IsMap()) {
    *out = nlohmann::json::object();
    for (const auto& member : node) {
      if (!member.first.IsScalar()) return absl::InvalidArgumentError(name + ": a key that is not plain text");
      const std::string key = member.first.Scalar();
      if (out->contains(key)) return absl::InvalidArgumentError(name + ": " + key + ": given twice");
      absl::Status status = Convert(name, member.second, depth + 1, node_count, &(*out)[key]);
      if (!status.ok()) return status;
    }
  } else if (node.IsSequence()) {
    *out = nlohmann::json::array();
    for (const auto& item : node) {
      out->push_back(nullptr);
      absl::Status status = Convert(name, item, depth + 1, node_count, &out->back());
      if (!status.ok()) return status;
    }
  } else if (node.IsScalar()) {
    const std::string& text = node.Scalar();
    *out = text;
    // "?" is a plain scalar; "!" was written in quotes.
    if (node.Tag() == "?") {
      const nlohmann::json parsed = nlohmann::json::parse(text, nullptr, false);
      if (parsed.is_number() || parsed.is_boolean()) *out = parsed;
    }
  } else {
    *out = nullptr;
  }
  return absl::OkStatus();
}

}  // namespace

void Problems::Add(const std::string& path, const std::string& value, const std::string& wanted) {
  lines_.push_back(path + ": " + value + ", want " + wanted);
}

absl::Status Problems::ToStatus() const {
  if (lines_.empty()) return absl::OkStatus();
  std::string text;
  for (std::size_t i = 0; i < std::min(lines_.size(), kGreatestProblemCount); ++i) {
    if (i > 0) text += "\n";
    text += lines_[i];
  }
  if (lines_.size() > kGreatestProblemCount) {
    text += "\nand " + std::to_string(lines_.size() - kGreatestProblemCount) + " more";
  }
  return absl::InvalidArgumentError(text);
}

void Field::Refuse(const std::string& wanted) const {
  if (value_ != nullptr) problems_->Add(path_, Shown(*value_), wanted);
}

Field Field::At(const std::string& key) const {
  const std::string path = path_.empty() ? key : path_ + "." + key;
  if (value_ == nullptr) return {nullptr, path, problems_};
  if (!value_->is_object()) {
    Refuse("an object with " + key);
    return {nullptr, path, problems_};
  }
  const auto found = value_->find(key);
  if (found == value_->end() || found->is_null()) {
    problems_->Add(path, "missing", "a value");
    return {nullptr, path, problems_};
  }
  return {&*found, path, problems_};
}

std::optional<Field> Field::Find(const std::string& key) const {
  if (value_ == nullptr || !value_->is_object()) return std::nullopt;
  const auto found = value_->find(key);
  if (found == value_->end() || found->is_null()) return std::nullopt;
  return Field(&*found, path_.empty() ? key : path_ + "." + key, problems_);
}

std::vector<Field> Field::Items(std::size_t minimum_count, std::size_t maximum_count) const {
  std::vector<Field> items;
  if (value_ == nullptr) return items;
  if (!value_->is_array() || value_->size() < minimum_count || value_->size() > maximum_count) {
    const std::string value = value_->is_array() ? std::to_string(value_->size()) + " values" : Shown(*value_);
    problems_->Add(path_, value,
                   "a list of " + std::to_string(minimum_count) +
                       (minimum_count == maximum_count ? "" : " to " + std::to_string(maximum_count)) + " values");
    return items;
  }
  items.reserve(value_->size());
  for (std::size_t i = 0; i < value_->size(); ++i) {
    items.emplace_back(&(*value_)[i], path_ + "[" + std::to_string(i) + "]", problems_);
  }
  return items;
}

std::vector<std::pair<std::string, Field>> Field::Members(std::size_t minimum_count, std::size_t maximum_count) const {
  std::vector<std::pair<std::string, Field>> members;
  if (value_ == nullptr) return members;
  if (!value_->is_object() || value_->size() < minimum_count || value_->size() > maximum_count) {
    Refuse("an object of " + std::to_string(minimum_count) + " to " + std::to_string(maximum_count) + " named values");
    return members;
  }
  for (const auto& [key, value] : value_->items()) {
    members.emplace_back(key, Field(&value, path_ + "." + key, problems_));
  }
  return members;
}

void Field::OnlyKeys(const std::vector<std::string>& keys) const {
  if (!problems_->strict() || value_ == nullptr || !value_->is_object()) return;
  for (const auto& [key, value] : value_->items()) {
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
    std::string known;
    for (const std::string& name : keys) known += (known.empty() ? "" : ", ") + name;
    problems_->Add(path_.empty() ? key : path_ + "." + key, "unknown", "one of " + known);
  }
}

double Field::Number(double minimum, double maximum) const {
  if (value_ == nullptr) return 0;
  const double number = value_->is_number() ? value_->get<double>() : std::nan("");
  if (!std::isfinite(number)) {
    Refuse("a finite number");
    return 0;
  }
  if (number < minimum || number > maximum) {
    Refuse("a number from " + NumberText(minimum) + " to " + NumberText(maximum));
    return 0;
  }
  return number;
}

double Field::Positive(double maximum) const {
  if (value_ == nullptr) return 1;
  const double number = value_->is_number() ? value_->get<double>() : std::nan("");
  if (!(number > 0 && number <= maximum)) {
    Refuse("a number > 0" + (maximum < kGreatest ? " and <= " + NumberText(maximum) : std::string()));
    return 1;
  }
  return number;
}

std::int64_t Field::Whole(std::int64_t minimum, std::int64_t maximum) const {
  if (value_ == nullptr) return minimum;
  // An unsigned value past the signed range must not wrap into it.
  const bool fits = value_->is_number_integer() &&
                    (!value_->is_number_unsigned() ||
                     value_->get<std::uint64_t>() <= std::uint64_t{std::numeric_limits<std::int64_t>::max()});
  const std::int64_t number = fits ? value_->get<std::int64_t>() : 0;
  if (!fits || number < minimum || number > maximum) {
    Refuse("a whole number from " + std::to_string(minimum) + " to " + std::to_string(maximum));
    return minimum;
  }
  return number;
}

bool Field::Flag() const {
  if (value_ == nullptr) return false;
  if (!value_->is_boolean()) {
    Refuse("true or false");
    return false;
  }
  return value_->get<bool>();
}

std::string Field::Text() const {
  if (value_ == nullptr) return {};
  const std::string text = value_->is_string() ? value_->get<std::string>() : std::string();
  const bool plain = std::none_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; });
  if (text.empty() || text.size() > 256 || !plain) {
    Refuse("text (in quotes where it looks like a number), 1 to 256 characters");
    return {};
  }
  return text;
}

std::string TextAt(const Field& field, const std::string& key) {
  const std::optional<Field> found = field.Find(key);
  return found ? found->Text() : std::string();
}

std::string Field::Lines(std::size_t most_bytes) const {
  if (value_ == nullptr) return {};
  const std::string text = value_->is_string() ? value_->get<std::string>() : std::string();
  const bool plain =
      std::none_of(text.begin(), text.end(), [](unsigned char c) { return (c < 0x20 && c != '\n') || c == 0x7f; });
  if (text.empty() || text.size() > most_bytes || !plain) {
    Refuse("lines of text, 1 to " + std::to_string(most_bytes) + " bytes");
    return {};
  }
  return text;
}

std::string Field::Id() const {
  if (value_ == nullptr) return {};
  const std::string text = value_->is_string() ? value_->get<std::string>() : std::string();
  if (text.empty() || text.size() > 64 || !std::all_of(text.begin(), text.end(), IsIdCharacter)) {
    Refuse("letters, digits, '.', '_' or '-', 1 to 64 of them");
    return {};
  }
  return text;
}

std::string Field::Choice(const std::vector<std::string>& choices) const {
  if (value_ == nullptr) return choices.front();
  const std::string text = value_->is_string() ? value_->get<std::string>() : std::string();
  if (std::find(choices.begin(), choices.end(), text) == choices.end()) {
    std::string known;
    for (const std::string& choice : choices) known += (known.empty() ? "" : ", ") + choice;
    Refuse("one of " + known);
    return choices.front();
  }
  return text;
}

Eigen::Vector2d Field::Vector2() const {
  Eigen::Vector2d vector = Eigen::Vector2d::Zero();
  const std::vector<Field> items = Items(2, 2);
  for (std::size_t i = 0; i < items.size(); ++i) vector[static_cast<int>(i)] = items[i].Number();
  return vector;
}

Eigen::Vector3d Field::Vector3() const {
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();
  const std::vector<Field> items = Items(3, 3);
  for (std::size_t i = 0; i < items.size(); ++i) vector[static_cast<int>(i)] = items[i].Number();
  return vector;
}

Eigen::Vector3d Field::Direction() const {
  const Eigen::Vector3d vector = Vector3();
  if (value_ == nullptr) return Eigen::Vector3d::UnitZ();
  if (std::abs(vector.norm() - 1) > 1e-6) {
    Refuse("a direction of length 1 (within 1e-6)");
    return Eigen::Vector3d::UnitZ();
  }
  return vector.normalized();
}

Eigen::Vector3d Field::DirectionOfAnyLength() const {
  const Eigen::Vector3d vector = Vector3();
  if (value_ == nullptr) return Eigen::Vector3d::UnitZ();
  if (!(vector.norm() > 0)) {
    Refuse("a direction");
    return Eigen::Vector3d::UnitZ();
  }
  return vector.normalized();
}

Eigen::Matrix4d Field::RigidTransform() const {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  if (value_ == nullptr) return matrix;
  const std::vector<Field> rows = Items(4, 4);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const std::vector<Field> values = rows[r].Items(4, 4);
    for (std::size_t c = 0; c < values.size(); ++c) {
      matrix(static_cast<int>(r), static_cast<int>(c)) = values[c].Number();
    }
  }
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const bool rigid = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-6 &&
                     rotation.determinant() > 0 && matrix.row(3) == Eigen::RowVector4d(0, 0, 0, 1);
  if (rows.empty() || rigid) return matrix;
  Refuse("a rigid transform: 4 rows of 4, orthonormal, right-handed, last row 0 0 0 1");
  return Eigen::Matrix4d::Identity();
}

std::string Field::PathInside() const {
  const std::string text = Text();
  if (value_ == nullptr || text.empty()) return {};
  const std::filesystem::path path(text);
  const bool climbs = std::any_of(path.begin(), path.end(), [](const auto& part) { return part == ".."; });
  if (path.is_absolute() || climbs) {
    Refuse("a path that stays inside the folder of this document");
    return {};
  }
  return text;
}

absl::StatusOr<std::string> ReadFile(const std::string& path, std::uint64_t greatest_bytes) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return absl::NotFoundError(path + ": no such file");
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (error) return absl::NotFoundError(path + ": " + error.message());
  if (size > greatest_bytes) {
    return Refuse(path, std::to_string(size) + " bytes", "at most " + std::to_string(greatest_bytes));
  }
  std::ifstream in(path, std::ios::binary);
  std::string content(size, '\0');
  in.read(content.data(), static_cast<std::streamsize>(size));
  if (static_cast<std::uint64_t>(in.gcount()) != size) return absl::DataLossError(path + ": cannot be read to its end");
  return content;
}

absl::Status WriteFile(const std::string& path, const std::string& content) {
  const std::string beside = path + ".part";
  std::ofstream out(beside, std::ios::binary | std::ios::trunc);
  out.write(content.data(), static_cast<std::streamsize>(content.size()));
  out.close();
  std::error_code error;
  if (out) std::filesystem::rename(beside, path, error);
  if (!out || error) {
    std::remove(beside.c_str());
    return absl::PermissionDeniedError(path + ": cannot be written" + (error ? ": " + error.message() : ""));
  }
  return absl::OkStatus();
}

absl::StatusOr<nlohmann::json> ParseJson(const std::string& name, const std::string& text) {
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::exception& error) {
    return absl::InvalidArgumentError(name + ": not JSON: " + error.what());
  }
}

absl::StatusOr<nlohmann::json> ParseYaml(const std::string& name, const std::string& text) {
  try {
    const YAML::Node node = YAML::Load(text);
    nlohmann::json document;
    int node_count = 0;
    absl::Status status = Convert(name, node, 0, &node_count, &document);
    if (!status.ok()) return status;
    return document;
  } catch (const YAML::Exception& error) {
    return absl::InvalidArgumentError(name + ": not YAML: " + error.what());
  }
}

absl::StatusOr<nlohmann::json> LoadDocument(const std::string& path) {
  absl::StatusOr<std::string> text = ReadFile(path, kGreatestDocumentBytes);
  if (!text.ok()) return text.status();
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending == ".json") return ParseJson(path, *text);
  if (ending == ".yaml" || ending == ".yml") return ParseYaml(path, *text);
  return Refuse(path, "file name ends in '" + ending + "'", ".yaml, .yml or .json");
}

}  // namespace sixpoint::cli
