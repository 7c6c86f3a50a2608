// The filters of a list as options of its command: one for each field of its request beside the page and the view, so that the
// tool asks whatever the contract can.
#pragma once

#include <absl/status/statusor.h>
#include <google/protobuf/message.h>

#include <memory>
#include <string>
#include <vector>

#include "cli/command_line.h"
#include "sixpoint/list/v1/list.pb.h"

namespace sixpoint::cli {

// `--limit N`, which every list has.
void AddLimitOption(Command* list, int* limit);
// Whether a list that has so many goes on; limit 0: to its end.
inline bool WantsMore(int limit, int count) { return limit == 0 || count < limit; }

// `--kinds K,...` of what reads the journal. Its help has the kinds that this release records; which there are, the plant says.
void AddKindsOption(Command* list, std::vector<std::string>* kinds);
const std::vector<std::string>& RecordKinds();

// `--since` and `--until` of what was recorded.
void AddSpanOptions(Command* list, std::string* since, std::string* until);
// What they say, each empty or a time. INVALID_ARGUMENT names the option.
absl::StatusOr<list::v1::TimeRange> TimeRangeOf(const std::string& since, const std::string& until);

// The words of an enum's option, its values in small letters without what their names begin with; and the value of one of them.
std::vector<std::string> WordsOf(const google::protobuf::EnumDescriptor& values);
int ValueOf(const google::protobuf::EnumDescriptor& values, const std::string& word);

class ListFilters {
 public:
  // `request` describes a List...Request. --blade, --machine, --part and --calibration take an id or a name, --since and --until
  // are its TimeRange, an enum's option takes its values in small letters; --limit comes with them.
  static std::shared_ptr<const ListFilters> AddTo(Command* list, const google::protobuf::Descriptor& request);

  // What was given; INVALID_ARGUMENT names the option.
  absl::Status SetOn(google::protobuf::Message* request) const;
  int limit() const { return limit_; }  // 0: all

 private:
  struct Filter {
    const google::protobuf::FieldDescriptor* field;
    std::string text;  // as given; empty: not
    bool flag = false;
  };
  void Add(Command* list, const google::protobuf::FieldDescriptor* field);
  absl::Status SetText(const Filter& filter, google::protobuf::Message* request) const;

  std::vector<std::unique_ptr<Filter>> filters_;  // options point into them
  std::string since_, until_;
  int limit_ = 0;
};

}  // namespace sixpoint::cli
