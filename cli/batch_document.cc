#include "cli/batch_document.h"

#include <string>
#include <utility>
#include <vector>

#include "cli/document.h"
#include "cli/output.h"
#include "cli/register_options.h"

namespace sixpoint::cli {
namespace {

using registration::v1::RegisterBatchRequest;

constexpr std::size_t kMostScans = 64;
constexpr std::size_t kMostRegions = 64;

const std::vector<std::string>& HowKeys() {
  static const auto* keys = new std::vector<std::string>{
      "method",         "axis_tables",       "free",     "in",           "not_in",         "weights", "coarse",
      "least_stock_mm", "greatest_stock_mm", "patch_mm", "least_points", "least_side_part"};
  return *keys;
}

// How an entry of a file is to be registered; what it does not say is as it was.
struct How {
  std::string method;
  bool axis_tables = false;
  RegisterOptions options;

  void Read(const Field& item) {
    const auto texts = [&](const char* key, std::vector<std::string>* out, const auto& read) {
      const auto field = item.Find(key);
      if (!field) return;
      out->clear();
      for (const Field& one : field->Items(1, kMostRegions)) out->push_back(read(one));
    };
    const auto region = [](const Field& one) {
      std::string text = one.Text();
      if (!text.empty() && !RegionOf(text).ok())
        one.Refuse("box:X,Y,Z:X,Y,Z, ball:X,Y,Z:RADIUS or holes:GROUP:MARGIN, in mm");
      return text;
    };
    if (const auto field = item.Find("method")) method = field->Choice(RegisterMethods());
    if (const auto field = item.Find("axis_tables")) axis_tables = field->Flag();
    texts("free", &options.free, [](const Field& one) { return one.Choice(RegisterFreedoms()); });
    texts("in", &options.in, region);
    texts("not_in", &options.not_in, region);
    if (const auto field = item.Find("weights")) {
      options.weights.clear();
      for (const Field& one : field->Items(1, kMostScans)) options.weights.push_back(one.Positive());
    }
    if (const auto field = item.Find("coarse")) options.coarse = field->Flag();
    for (const auto& [key, out] :
         {std::pair("least_stock_mm", &options.least_stock_mm),
          std::pair("greatest_stock_mm", &options.greatest_stock_mm), std::pair("patch_mm", &options.patch_mm)})
      if (const auto field = item.Find(key)) *out = field->Number();
    if (const auto field = item.Find("least_points"))
      options.least_points = static_cast<int>(field->Whole(1, 1'000'000));
    if (const auto field = item.Find("least_side_part")) options.least_side_part = field->Number(0, 1);
  }
};

}  // namespace

absl::StatusOr<RegisterBatchRequest> BatchFromDocument(const nlohmann::json& document) {
  Problems problems(/*strict=*/true);
  const Field root(&document, "", &problems);
  root.OnlyKeys({"defaults", "registrations"});
  How defaults;
  if (const auto field = root.Find("defaults")) {
    field->OnlyKeys(HowKeys());
    defaults.Read(*field);
  }
  std::vector<std::string> keys = HowKeys();
  keys.insert(keys.end(), {"blade", "scans"});
  RegisterBatchRequest batch;
  for (const Field& item : root.At("registrations").Items(1, kMostBatchRequests)) {
    item.OnlyKeys(keys);
    registration::v1::RegisterRequest& request = *batch.add_requests();
    request.set_blade(NameText("blades", item.At("blade").Text()));
    for (const Field& scan : item.At("scans").Items(1, kMostScans)) request.add_scans(NameText("scans", scan.Text()));
    How how = defaults;
    how.Read(item);
    if (how.method.empty()) item.At("method");  // notes that it is missing
    request.set_method(RegisterMethodOf(how.method));
    request.set_apply_axis_tables(how.axis_tables);
    auto options = FitOptionsOf(how.options);  // a wrong region was noted above
    if (options.ok() && options->ByteSizeLong() > 0) *request.mutable_options() = *std::move(options);
  }
  if (!problems.empty()) return problems.ToStatus();
  return batch;
}

}  // namespace sixpoint::cli
