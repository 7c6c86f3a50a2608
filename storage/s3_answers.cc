#include "storage/s3_answers.h"

#include <charconv>
#include <ctime>
#include <optional>
#include <string_view>
#include <utility>

namespace sixpoint::storage {
namespace {

// Text of the first <tag>...</tag> after `from`; these answers nest no element in itself.
std::optional<std::string_view> TextOf(std::string_view xml, const std::string& tag, std::size_t from = 0) {
  const std::string open = "<" + tag + ">", close = "</" + tag + ">";
  const std::size_t begin = xml.find(open, from);
  if (begin == std::string_view::npos) return std::nullopt;
  const std::size_t end = xml.find(close, begin);
  if (end == std::string_view::npos) return std::nullopt;
  return xml.substr(begin + open.size(), end - begin - open.size());
}

std::string Unescaped(std::string_view text) {
  static constexpr std::pair<std::string_view, char> kEntities[] = {
      {"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}, {"&#34;", '"'}, {"&#39;", '\''}};
  std::string plain;
  while (!text.empty()) {
    bool found = false;
    for (const auto& [entity, character] : kEntities) {
      if (text.substr(0, entity.size()) != entity) continue;
      plain += character;
      text.remove_prefix(entity.size());
      found = true;
      break;
    }
    if (found) continue;
    plain += text.front();
    text.remove_prefix(1);
  }
  return plain;
}

// "2026-11-21T03:25:01.000Z"; whole seconds are enough.
std::optional<Instant> TimeOf(std::string_view text) {
  std::tm utc{};
  const std::string whole(text);
  const char* rest = strptime(whole.c_str(), "%Y-%m-%dT%H:%M:%S", &utc);
  if (rest == nullptr || whole.back() != 'Z') return std::nullopt;
  return Instant(std::chrono::seconds(timegm(&utc)));
}

}  // namespace

std::string S3ErrorCodeOf(const std::string& xml) {
  if (xml.find("<Error>") == std::string::npos) return "";
  return std::string(TextOf(xml, "Code").value_or(""));
}

absl::StatusOr<ObjectStore::ListPage> ReadS3List(const std::string& xml) {
  const absl::Status misread = absl::InternalError("object store: the answer to a list is not one of S3's");
  const std::optional<std::string_view> truncated = TextOf(xml, "IsTruncated");
  if (xml.find("<ListBucketResult") == std::string::npos || !truncated) return misread;
  ObjectStore::ListPage page;
  if (*truncated == "true") page.next = Unescaped(TextOf(xml, "NextContinuationToken").value_or(""));
  if ((*truncated == "true") == page.next.empty()) return misread;
  for (std::size_t at = xml.find("<Contents>"); at != std::string::npos; at = xml.find("<Contents>", at + 1)) {
    const std::optional<std::string_view> object = TextOf(xml, "Contents", at);
    if (!object) return misread;
    const auto key = TextOf(*object, "Key"), size = TextOf(*object, "Size"), time = TextOf(*object, "LastModified");
    if (!key || !size || !time) return misread;
    const std::optional<Instant> modified_at = TimeOf(*time);
    std::int64_t size_bytes = 0;
    const auto read = std::from_chars(size->data(), size->data() + size->size(), size_bytes);
    if (!modified_at || read.ec != std::errc() || read.ptr != size->data() + size->size()) return misread;
    page.objects.push_back({Unescaped(*key), size_bytes, *modified_at});
  }
  return page;
}

}  // namespace sixpoint::storage
