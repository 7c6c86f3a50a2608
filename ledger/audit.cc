#include "ledger/audit.h"

#include <algorithm>
#include <utility>

namespace sixpoint::ledger {
namespace {

constexpr std::size_t kMostFindings = 100;

std::string Named(const Head& head) {
  return "the head of " + std::to_string(head.tree_size) + " entries, signed " + head.signed_at;
}

}  // namespace

Audit::Audit(std::vector<Head> sent, std::string public_pem)
    : sent_(std::move(sent)), public_pem_(std::move(public_pem)) {
  std::stable_sort(sent_.begin(), sent_.end(), [](const Head& a, const Head& b) { return a.tree_size < b.tree_size; });
  for (const Head& head : sent_) CheckSignature(head, "that was sent out");
}

void Audit::AddHead(const Head& head) {
  CheckSignature(head, "of the database");
  shown_.push_back(head);
}

void Audit::CheckSignature(const Head& head, const char* whose) {
  if (plant_id_.empty()) plant_id_ = head.plant_id;
  if (findings_.size() >= kMostFindings) return;
  if (head.plant_id != plant_id_)
    findings_.push_back({FindingKind::kAnotherPlant,
                         Named(head) + ", " + whose + ", is of plant " + head.plant_id + ", want " + plant_id_});
  if (!public_pem_.empty() && !IsSignedBy(head, public_pem_))
    findings_.push_back({FindingKind::kNotSigned,
                         Named(head) + ", " + whose + ", is not signed by the key given, but says key " + head.key_id});
}

void Audit::AddLeaves(const std::vector<Hash>& leaves) {
  for (const Hash& leaf : leaves) {
    range_.Append(leaf);
    for (; next_sent_ < sent_.size() && sent_[next_sent_].tree_size <= range_.size(); ++next_sent_)
      Compare(sent_[next_sent_]);
    const auto reached = std::stable_partition(shown_.begin(), shown_.end(),
                                               [&](const Head& head) { return head.tree_size > range_.size(); });
    for (auto head = reached; head != shown_.end(); ++head) Compare(*head);
    shown_.erase(reached, shown_.end());
  }
}

void Audit::Compare(const Head& head) {
  ++heads_checked_;
  if (head.tree_size == range_.size() && head.root == range_.Root()) {
    if (rewritten_count_ == 0) last_good_ = head;
    return;
  }
  // The first tells where: what follows differs, too.
  if (rewritten_count_++ > 0) return;
  findings_.push_back({FindingKind::kRewritten, "entries after " + std::to_string(last_good_.record_sequence) +
                                                    " up to " + std::to_string(head.record_sequence) +
                                                    " are not those of " + Named(head)});
}

void Audit::Finish() {
  if (rewritten_count_ > 1)
    findings_.push_back({FindingKind::kRewritten, std::to_string(rewritten_count_ - 1) + " later heads differ, too"});
  Head greatest;
  for (const auto* heads : {&sent_, &shown_})
    for (const Head& head : *heads)
      if (head.tree_size > greatest.tree_size) greatest = head;
  if (greatest.tree_size > range_.size())
    findings_.push_back({FindingKind::kCutOff, "there are " + std::to_string(range_.size()) +
                                                   " leaves, want those of " + Named(greatest) + ": entries up to " +
                                                   std::to_string(greatest.record_sequence) + " were cut off"});
  if (!public_pem_.empty() && range_.size() > 0 && heads_checked_ == 0)
    findings_.push_back({FindingKind::kNoHead, "no head was compared with the " + std::to_string(range_.size()) +
                                                   " leaves, want one that is signed by the key given"});
}

}  // namespace sixpoint::ledger
