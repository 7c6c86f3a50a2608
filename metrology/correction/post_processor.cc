#include "metrology/correction/post_processor.h"

#include <absl/strings/ascii.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <utility>

#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr std::array<const char*, 5> kAxisPlaceholders = {"x", "y", "z", "a", "b"};
constexpr char kDirectionPlaceholder[] = "v";

// A section, what it is called, and which texts its place has.
struct Section {
  const char* name;
  const std::string PostProcessor::*text;
  std::set<std::string> texts;
  bool has_words;  // of a hole or pose
};
const std::vector<Section>& Sections() {
  static const std::set<std::string> kOperation = {"operation", "tool", "feed", "diameter", "length"};
  static const auto with = [](std::set<std::string> more) {
    more.insert(kOperation.begin(), kOperation.end());
    return more;
  };
  static const std::vector<Section> kSections = {
      {"program_start", &PostProcessor::program_start, {}, false},
      {"operation_start", &PostProcessor::operation_start, kOperation, false},
      {"hole", &PostProcessor::hole, with({"group", "hole", "depth"}), true},
      {"path_start", &PostProcessor::path_start, with({"path", "number"}), true},
      {"path_pose", &PostProcessor::path_pose, with({"path", "number"}), true},
      {"path_end", &PostProcessor::path_end, with({"path"}), false},
      {"operation_end", &PostProcessor::operation_end, kOperation, false},
      {"program_end", &PostProcessor::program_end, {}, false}};
  return kSections;
}
const Section& SectionOf(const std::string PostProcessor::*text) {
  return *std::find_if(Sections().begin(), Sections().end(), [&](const Section& one) { return one.text == text; });
}

std::vector<std::string> TextLines(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0, end = 0; begin < text.size(); begin = end + 1) {
    end = std::min(text.find('\n', begin), text.size());
    lines.push_back(text.substr(begin, end - begin));
  }
  return lines;
}

// A line apart: plain text, and what stands in braces.
struct LinePiece {
  bool braced = false;
  std::string text;
};
// None: a brace is not closed, or not opened.
std::optional<std::vector<LinePiece>> PiecesOf(const std::string& line) {
  std::vector<LinePiece> pieces;
  for (std::size_t at = 0; at < line.size();) {
    const std::size_t open = line.find_first_of("{}", at);
    if (open != at) pieces.push_back({false, line.substr(at, open - at)});
    if (open == std::string::npos) break;
    const std::size_t close = line.find_first_of("{}", open + 1);
    if (line[open] == '}' || close == std::string::npos || line[close] == '{') return std::nullopt;
    pieces.push_back({true, line.substr(open + 1, close - open - 1)});
    at = close + 1;
  }
  return pieces;
}

int AxisOf(const std::string& braced) {
  const auto found = std::find(kAxisPlaceholders.begin(), kAxisPlaceholders.end(), braced);
  return found == kAxisPlaceholders.end() ? -1 : static_cast<int>(found - kAxisPlaceholders.begin());
}

// The axis whose word it is, with a value; empty: none.
std::string AxisWordOf(const PostProcessor& post, const std::string& word) {
  for (const std::string& axis : post.axis_words) {
    const std::size_t past = axis.size() + (axis.size() > 1 ? 1 : 0);
    if (word.compare(0, axis.size(), axis) == 0 && word.size() > past &&
        std::isalpha(static_cast<unsigned char>(word[past])) == 0)
      return axis;
  }
  return "";
}

// Words of one line by blanks.
std::vector<std::string> WordsOf(const std::string& text) {
  std::vector<std::string> words;
  for (std::size_t begin = 0, end = 0; begin < text.size(); begin = end + 1) {
    end = std::min(text.find(' ', begin), text.size());
    if (end > begin) words.push_back(text.substr(begin, end - begin));
  }
  return words;
}

// Beside words of a hole: a value of an axis would be replaced as theirs are, and a comment would hide the marker.
absl::Status CheckBesideWords(const PostProcessor& post, const std::string& at, const std::vector<LinePiece>& pieces) {
  for (const LinePiece& piece : pieces) {
    if (piece.braced) continue;
    if (piece.text.find(';') != std::string::npos) return Refuse(at, piece.text, "comments in lines of their own");
    for (const std::string& word : WordsOf(piece.text))
      if (!AxisWordOf(post, word).empty()) return Refuse(at, word, "braces, or a line of its own");
  }
  return absl::OkStatus();
}

absl::Status CheckLine(const PostProcessor& post, const Section& section, const std::string& at,
                       const std::string& line) {
  std::string upper = line;
  for (char& c : upper) {
    if (c < 0x20 || c > 0x7e) return Refuse(at, line, "printable ASCII");
    c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  if (upper.find("SIXPOINT") != std::string::npos) return Refuse(at, line, "no marker: lines with words are marked");
  if (post.semicolon_comments && line.find('(') != std::string::npos && line != "TRAORI(1)")
    return Refuse(at, line, "comments after a semicolon, and no brackets but of TRAORI(1)");
  const auto pieces = PiecesOf(line);
  if (!pieces) return Refuse(at, line, "each { with its }");
  std::set<std::string> words;
  for (const LinePiece& piece : *pieces) {
    if (!piece.braced) continue;
    const bool is_word = AxisOf(piece.text) >= 0 || piece.text == kDirectionPlaceholder;
    if (!is_word && section.texts.count(piece.text) == 0)
      return Refuse(at, "{" + piece.text + "}", "what there is in " + std::string(section.name));
    if (is_word && !section.has_words) return Refuse(at, "{" + piece.text + "}", "no words of a hole or pose here");
    if (is_word && !words.insert(piece.text).second) return Refuse(at, "{" + piece.text + "}", "once in a line");
  }
  if (!words.empty())
    if (absl::Status beside = CheckBesideWords(post, at, *pieces); !beside.ok()) return beside;
  if (words.count(kDirectionPlaceholder) == 0) return absl::OkStatus();
  if (!post.directions) return Refuse(at, "{v}", "a control that has directions");
  if (section.text != &PostProcessor::path_pose) return Refuse(at, "{v}", "it in path_pose alone");
  if (words != std::set<std::string>{"v", "x", "y", "z"}) return Refuse(at, line, "{x}, {y} and {z} beside {v}");
  return absl::OkStatus();
}

absl::Status CheckWords(const PostProcessor& post) {
  Refusals refusals;
  std::set<std::string> seen;
  for (std::size_t i = 0; i < kAxisPlaceholders.size(); ++i) {
    const std::string& word = post.axis_words[i];
    const std::string at = std::string("axis_words.") + kAxisPlaceholders[i];
    const bool letter = !word.empty() && word[0] >= 'A' && word[0] <= 'Z' &&
                        std::string("DFGHIJKLMNOPQRST").find(word[0]) == std::string::npos;
    const bool number = word.size() <= 3 && std::all_of(word.begin() + !word.empty(), word.end(), absl::ascii_isdigit);
    if (!letter || !number)
      refusals.Add(Refuse(at, word, "A to C, E, U to Z, or one of them with a number such as C1"));
    if (!seen.insert(word).second) refusals.Add(Refuse(at, word, "a word that no other axis has"));
    if (post.directions && (word == "A3" || word == "B3" || word == "C3"))
      refusals.Add(Refuse(at, word, "no word of a direction"));
  }
  return refusals.status();
}

absl::Status CheckRange(const char* at, int value, int least, int most) {
  if (value >= least && value <= most) return absl::OkStatus();
  return Refuse(at, std::to_string(value), std::to_string(least) + " to " + std::to_string(most));
}

// What stands in braces, for one place of the program.
struct Place {
  std::string mark;  // empty: no hole and no pose
  std::map<std::string, std::string> texts;
};

class Writer {
 public:
  Writer(const PostProcessor& post, std::size_t most_bytes)
      : post_(post), most_bytes_(most_bytes), next_(post.first_number) {}

  absl::Status Write(const std::vector<PostOperation>& operations) {
    if (absl::Status status = Add(&PostProcessor::program_start, {}); !status.ok()) return status;
    for (const PostOperation& operation : operations)
      if (absl::Status status = Write(operation); !status.ok()) return status;
    return Add(&PostProcessor::program_end, {});
  }

  std::string program;

 private:
  absl::Status Write(const PostOperation& operation) {
    Place place;
    place.texts = {{"operation", operation.operation},
                   {"diameter", NumberText(operation.electrode_diameter_mm)},
                   {"length", NumberText(operation.electrode_length_mm)}};
    if (operation.tool_number) place.texts["tool"] = std::to_string(*operation.tool_number);
    if (operation.feed_mm_min) place.texts["feed"] = NumberText(*operation.feed_mm_min);
    if (absl::Status status = Add(&PostProcessor::operation_start, place); !status.ok()) return status;
    for (const PostHole& hole : operation.holes) {
      Place at = place;
      at.mark = hole.group + "/" + hole.hole;
      at.texts.insert({{"group", hole.group}, {"hole", hole.hole}, {"depth", NumberText(hole.depth_mm)}});
      if (absl::Status status = AddWork(&PostProcessor::hole, at); !status.ok()) return status;
    }
    for (const PostPath& path : operation.paths)
      if (absl::Status status = Write(path, place); !status.ok()) return status;
    return Add(&PostProcessor::operation_end, place);
  }

  absl::Status Write(const PostPath& path, Place place) {
    place.texts["path"] = path.path;
    for (int number = 1; number <= path.pose_count; ++number) {
      place.texts["number"] = std::to_string(number);
      place.mark = path.path + "/" + std::to_string(number);
      for (const std::string& axis : post_.axis_words) in_force_.erase("=" + axis);  // another pose's
      const absl::Status status =
          number == 1 ? AddWork(&PostProcessor::path_start, place) : AddNeeded(&PostProcessor::path_pose, place);
      if (!status.ok()) return status;
    }
    place.mark.clear();
    place.texts.erase("number");
    return AddNeeded(&PostProcessor::path_end, place);
  }

  // What a hole or a path begins with says all anew: others may be left out before it.
  absl::Status AddWork(const std::string PostProcessor::*text, const Place& place) {
    Forget();
    return AddNeeded(text, place);
  }
  absl::Status AddNeeded(const std::string PostProcessor::*text, const Place& place) {
    if ((post_.*text).find_first_not_of(" \n") == std::string::npos)
      return Refuse(SectionOf(text).name, "empty", "the blocks of " + (place.mark.empty() ? "a path" : place.mark));
    return Add(text, place);
  }

  absl::Status Add(const std::string PostProcessor::*text, const Place& place) {
    int number = 0;
    for (const std::string& line : TextLines(post_.*text))
      if (absl::Status status =
              AddLine(std::string(SectionOf(text).name) + " line " + std::to_string(++number), line, place);
          !status.ok())
        return status;
    return absl::OkStatus();
  }

  absl::Status AddLine(const std::string& at, const std::string& line, const Place& place) {
    const std::optional<std::vector<LinePiece>> pieces = PiecesOf(line);  // it was let pass
    std::string text;
    bool marked = false;
    const auto blank = [&] { return text.empty() || text.back() == ' '; };
    for (const LinePiece& piece : pieces.value_or(std::vector<LinePiece>())) {
      if (!piece.braced) {
        text += piece.text;
      } else if (const int axis = AxisOf(piece.text); axis >= 0) {
        text += (blank() ? "" : " ") + Word(post_.axis_words[static_cast<std::size_t>(axis)], Decimals(axis));
        marked = true;
      } else if (piece.text == kDirectionPlaceholder) {
        for (const char* const word : {"A3", "B3", "C3"})
          text += (blank() ? "" : " ") + Word(word, post_.direction_decimals);
        marked = true;
      } else {
        const auto found = place.texts.find(piece.text);
        if (found == place.texts.end())
          return Refuse(at, "{" + piece.text + "}", "an operation that states it: " + place.texts.at("operation"));
        text += found->second;
      }
    }
    if (post_.leaves_out_repeated && !place.mark.empty()) text = WithoutRepeated(text, marked);
    if (text.find_first_not_of(' ') == std::string::npos) return absl::OkStatus();
    return Append(text, marked ? place.mark : "");
  }

  absl::Status Append(const std::string& text, const std::string& mark) {
    const bool has_number = text.size() > 1 && absl::ascii_isdigit(text[1]) && (text[0] == 'N' || text[0] == 'O');
    if (post_.number_step > 0 && std::isalpha(static_cast<unsigned char>(text[0])) != 0 && !has_number) {
      program += "N" + std::to_string(next_) + " ";
      next_ += post_.number_step;
    }
    program += text;
    if (!mark.empty()) program += post_.semicolon_comments ? " ; SIXPOINT " + mark : " (SIXPOINT " + mark + ")";
    program += '\n';
    if (program.size() <= most_bytes_) return absl::OkStatus();
    return Refuse("program", "more than " + std::to_string(most_bytes_) + " bytes at " + mark, "at most as many");
  }

  int Decimals(int axis) const { return axis < 3 ? post_.linear_decimals : post_.rotary_decimals; }
  std::string Word(const std::string& word, int decimals) const {
    return word + (word.size() > 1 ? "=" : "") + (post_.explicit_plus ? "+0." : "0.") +
           std::string(static_cast<std::size_t>(decimals), '0');
  }

  void Forget() { in_force_.clear(); }

  // Words by blanks. What changes what a word means, and a comment, makes all be said anew.
  std::string WithoutRepeated(const std::string& text, bool marked) {
    if (text.find_first_of("(;") != std::string::npos) {
      Forget();
      return text;
    }
    std::string kept;
    for (const std::string& word : WordsOf(text))
      if (!IsInForce(word, marked)) kept += (kept.empty() ? "" : " ") + word;
    return kept;
  }

  bool IsInForce(const std::string& word, bool marked) {
    const std::string kind = KindOf(word);
    if (kind.empty()) return false;
    if (kind == "all") {
      Forget();
      return false;
    }
    // A word of an axis is the hole's only in a marked line; by steps it is another one each time.
    const bool of_axis = kind[0] == '=';
    if (of_axis && (!marked || in_force_["distance"] != "G90")) {
      in_force_.erase(kind);
      return false;
    }
    std::string& now = in_force_[kind];
    if (now == word) return true;
    now = word;
    if (kind == "distance")
      for (const std::string& axis : post_.axis_words) in_force_.erase("=" + axis);
    return false;
  }

  // What a word sets; empty: nothing that is looked at.
  std::string KindOf(const std::string& word) const {
    if (word == "G0" || word == "G00" || word == "G1" || word == "G01") return "motion";
    if (word == "G90" || word == "G91") return "distance";
    if (word[0] == 'G' || word.find("TRA") == 0) return "all";
    if (word[0] == 'F') return "feed";
    const std::string axis = AxisWordOf(post_, word);
    return axis.empty() ? "" : "=" + axis;
  }

  const PostProcessor& post_;
  const std::size_t most_bytes_;
  long next_;
  std::map<std::string, std::string> in_force_;  // by what it sets
};

}  // namespace

absl::Status CheckPostProcessor(const PostProcessor& post) {
  Refusals refusals;
  refusals.Add(CheckWords(post))
      .Add(CheckRange("linear_decimals", post.linear_decimals, kLeastPostDecimals, kMostPostDecimals))
      .Add(CheckRange("rotary_decimals", post.rotary_decimals, kLeastPostDecimals, kMostPostDecimals))
      .Add(CheckRange("direction_decimals", post.direction_decimals, kLeastDirectionDecimals, kMostPostDecimals))
      .Add(CheckRange("first_number", post.first_number, 0, 1'000'000))
      .Add(CheckRange("number_step", post.number_step, 0, 1000));
  if (post.directions && !post.semicolon_comments)
    refusals.Add(
        Refuse("comment", "in brackets", "after a semicolon: a control with directions reads brackets as a call"));
  for (const Section& section : Sections()) {
    const std::string& text = post.*section.text;
    if (text.size() > kMostSectionBytes)
      refusals.Add(
          Refuse(section.name, std::to_string(text.size()) + " bytes", "at most " + std::to_string(kMostSectionBytes)));
    int number = 0;
    for (const std::string& line : TextLines(text.substr(0, kMostSectionBytes)))
      refusals.Add(CheckLine(post, section, std::string(section.name) + " line " + std::to_string(++number), line));
  }
  return refusals.status();
}

absl::StatusOr<std::string> WriteTemplate(const PostProcessor& post, const std::vector<PostOperation>& operations,
                                          std::size_t most_bytes) {
  Writer writer(post, most_bytes);
  if (absl::Status status = writer.Write(operations); !status.ok()) return status;
  return std::move(writer.program);
}

}  // namespace sixpoint::metrology
