#include "storage/denials.h"

#include <algorithm>

namespace sixpoint::storage {
namespace {

constexpr char kInsertDenial[] =
    "INSERT INTO denials (denial_id, area, method, caller, peer_address, reason, sentence, denied_count, "
    "first_denied_at, "
    "last_denied_at) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10)";

// Not in the middle of a character.
std::string Cut(const std::string& text, std::size_t most_bytes) {
  if (text.size() <= most_bytes) return text;
  std::size_t end = most_bytes;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return text.substr(0, end);
}

}  // namespace

absl::Status AppendDenials(Transaction& transaction, std::vector<Denial> denials) {
  // Two services that see persons for the first time see them in one order.
  std::stable_sort(denials.begin(), denials.end(),
                   [](const Denial& a, const Denial& b) { return a.caller < b.caller; });
  for (const Denial& denial : denials) {
    Params params;
    params.Uuid(NewUuid()).Text(Cut(denial.area, 64)).Text(Cut(denial.method, 200)).Text(Cut(denial.caller, 200));
    params.Text(Cut(denial.peer_address, 200)).Text(Cut(denial.reason, 64)).Text(Cut(denial.sentence, 1000));
    params.Int(denial.count).Time(denial.first_denied_at).Time(denial.last_denied_at);
    if (const auto inserted = transaction.Execute(kInsertDenial, params); !inserted.ok()) return inserted.status();
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::storage
