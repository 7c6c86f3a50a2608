#include "ledger/head.h"

#include <fcntl.h>
#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "refusal/refusal.h"

namespace sixpoint::ledger {
namespace {

constexpr std::size_t kSignatureBytes = 64, kHashBytes = 32, kMostLineBytes = 4096, kMostKeyBytes = 4096;

template <auto Free>
struct FreedBy {
  template <typename Object>
  void operator()(Object* object) const {
    Free(object);
  }
};
using Key = std::unique_ptr<EVP_PKEY, FreedBy<EVP_PKEY_free>>;
using Bio = std::unique_ptr<BIO, FreedBy<BIO_free>>;
using Signing = std::unique_ptr<EVP_MD_CTX, FreedBy<EVP_MD_CTX_free>>;

std::string TextIn(const Bio& bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio.get(), &data);
  return {data, static_cast<std::size_t>(size)};
}

// No key: what PEM holds is none, or is of another kind.
Key PublicKeyOf(const std::string& pem) {
  const Bio bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
  Key key(PEM_read_bio_PUBKEY(bio.get(), nullptr, nullptr, nullptr));
  if (key != nullptr && EVP_PKEY_id(key.get()) != EVP_PKEY_ED25519) key.reset();
  return key;
}

std::string IdOf(EVP_PKEY* key) {
  unsigned char* der = nullptr;
  const int size = i2d_PUBKEY(key, &der);
  if (size <= 0) return "";
  const std::string bytes(reinterpret_cast<const char*>(der), static_cast<std::size_t>(size));
  OPENSSL_free(der);
  return HexOf(Sha256(bytes)).substr(0, 16);
}

absl::Status FileError(const std::string& path, const std::string& wanted) {
  return Refuse(path, std::strerror(errno), wanted);
}

class File {
 public:
  File(const std::string& path, int flags, mode_t mode = 0644) : number_(open(path.c_str(), flags | O_CLOEXEC, mode)) {}
  ~File() {
    if (number_ >= 0) close(number_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int number() const { return number_; }

 private:
  int number_;
};

// Whole or not at all.
absl::Status WriteWhole(const std::filesystem::path& path, const std::string& content, mode_t mode) {
  const std::string beside = path.string() + ".new";
  unlink(beside.c_str());
  const File file(beside, O_WRONLY | O_CREAT | O_EXCL, mode);
  if (file.number() < 0 || fchmod(file.number(), mode) != 0 ||
      write(file.number(), content.data(), content.size()) != static_cast<ssize_t>(content.size()) ||
      fsync(file.number()) != 0 || rename(beside.c_str(), path.c_str()) != 0)
    return FileError(path, "a file that can be written");
  return absl::OkStatus();
}

// The file's last bytes, some lines at most.
absl::StatusOr<std::string> TailOf(const std::string& path, const File& file) {
  const off_t size = lseek(file.number(), 0, SEEK_END);
  const off_t begin = std::max<off_t>(0, size - static_cast<off_t>(2 * kMostLineBytes));
  std::string tail(static_cast<std::size_t>(size - begin), '\0');
  if (pread(file.number(), tail.data(), tail.size(), begin) != static_cast<ssize_t>(tail.size()))
    return FileError(path, "a file of heads");
  return tail;
}

// Its last line that was written whole, with or without its end; size 0: there is none.
absl::StatusOr<Head> LastOf(const std::string& tail) {
  const std::size_t end = tail.rfind('\n');
  const std::size_t torn = end + 1;  // npos + 1 is 0
  if (torn < tail.size())
    if (absl::StatusOr<Head> head = HeadOfJson(tail.substr(torn)); head.ok()) return head;
  if (end == std::string::npos) return Head();
  const std::size_t before = end == 0 ? std::string::npos : tail.rfind('\n', end - 1);
  const std::size_t begin = before == std::string::npos ? 0 : before + 1;
  return HeadOfJson(tail.substr(begin, end - begin));
}

}  // namespace

std::string SignedText(const Head& head) {
  return "sixpoint-ledger-head-1\n" + head.plant_id + "\n" + std::to_string(head.tree_size) + "\n" + HexOf(head.root) +
         "\n" + std::to_string(head.record_sequence) + "\n" + head.signed_at + "\n";
}

std::string JsonLineOf(const Head& head) {
  nlohmann::ordered_json line;
  line["plant_id"] = head.plant_id;
  line["tree_size"] = head.tree_size;
  line["root_sha256"] = HexOf(head.root);
  line["record_sequence"] = head.record_sequence;
  line["signed_at"] = head.signed_at;
  line["key_id"] = head.key_id;
  line["signature"] = HexOf(head.signature);
  return line.dump();
}

absl::StatusOr<Head> HeadOfJson(const std::string& line) {
  const nlohmann::json json = nlohmann::json::parse(line, nullptr, /*allow_exceptions=*/false);
  const absl::Status refused = Refuse("head", line.substr(0, 200), "a line of JSON as docs/ledger.md has it");
  if (!json.is_object()) return refused;
  const auto text = [&](const char* key) {
    const auto found = json.find(key);
    return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  const auto number = [&](const char* key) {
    const auto found = json.find(key);
    return found != json.end() && found->is_number_integer() ? found->get<std::int64_t>() : std::int64_t{-1};
  };
  const Head head{text("plant_id"),  number("tree_size"), BytesOfHex(text("root_sha256")), number("record_sequence"),
                  text("signed_at"), text("key_id"),      BytesOfHex(text("signature"))};
  const bool whole = !head.plant_id.empty() && head.tree_size > 0 && head.root.size() == kHashBytes &&
                     head.record_sequence > 0 && !head.signed_at.empty() && head.signature.size() == kSignatureBytes;
  if (!whole) return refused;
  return head;
}

absl::StatusOr<std::vector<Head>> ReadHeads(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file.is_open()) return FileError(path, "a file of heads, one a line");
  std::vector<Head> heads;
  std::size_t number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    absl::StatusOr<Head> head = HeadOfJson(line);
    if (file.eof() && !head.ok()) break;  // without its end of line: not written whole, or copied without that
    if (!head.ok()) return Refuse(path + ":" + std::to_string(number), line.substr(0, 200), "a head, one a line");
    heads.push_back(*std::move(head));
  }
  return heads;
}

absl::StatusOr<Head> LastHead(const std::string& path) {
  const File file(path, O_RDONLY);
  if (file.number() < 0) return errno == ENOENT ? absl::StatusOr<Head>(Head()) : FileError(path, "a file of heads");
  const absl::StatusOr<std::string> tail = TailOf(path, file);
  return tail.ok() ? LastOf(*tail) : tail.status();
}

absl::Status AppendHead(const std::string& path, const Head& head) {
  const File file(path, O_RDWR | O_APPEND | O_CREAT);
  // Until the file is closed: of two processes that send out at the same moment one sees what the other wrote.
  if (file.number() < 0 || flock(file.number(), LOCK_EX) != 0)
    return FileError(path, "a file that the plant's service can append to");
  const absl::StatusOr<std::string> tail = TailOf(path, file);
  if (!tail.ok()) return tail.status();
  const absl::StatusOr<Head> last = LastOf(*tail);
  if (!last.ok()) return last.status();
  if (last->tree_size >= head.tree_size) return absl::OkStatus();
  // What was not written whole before a crash was never sent; where the end of its line alone is missing, it gets one.
  const std::string rest = tail->substr(tail->rfind('\n') + 1);  // npos + 1 is 0
  const bool is_whole = HeadOfJson(rest).ok();
  const std::string line = (is_whole ? "\n" : "") + JsonLineOf(head) + "\n";
  const off_t size = lseek(file.number(), 0, SEEK_END);
  const off_t torn = is_whole ? 0 : static_cast<off_t>(rest.size());
  if (size < 0 || (torn > 0 && ftruncate(file.number(), size - torn) != 0) ||
      write(file.number(), line.data(), line.size()) != static_cast<ssize_t>(line.size()) || fsync(file.number()) != 0)
    return FileError(path, "a file that the plant's service can append to");
  return absl::OkStatus();
}

absl::StatusOr<std::string> SigningKey::NewPem() {
  const Key key(EVP_PKEY_Q_keygen(nullptr, nullptr, "ED25519"));
  const Bio bio(BIO_new(BIO_s_mem()));
  if (key == nullptr || PEM_write_bio_PKCS8PrivateKey(bio.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) != 1)
    return absl::InternalError("OpenSSL makes no Ed25519 key");
  return TextIn(bio);
}

absl::StatusOr<SigningKey> SigningKey::Read(const std::string& path) {
  const File file(path, O_RDONLY);
  struct stat found {};
  if (file.number() < 0 || fstat(file.number(), &found) != 0)
    return FileError(path, "the ledger's private key, which `sixpoint up` makes");
  if ((found.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return Refuse(path, "a file that others than its owner may use", "mode 0600: the key signs for who reads it");
  std::string pem(kMostKeyBytes, '\0');
  const ssize_t size = read(file.number(), pem.data(), pem.size());
  pem.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
  absl::StatusOr<SigningKey> key = OfPem(pem);
  if (!key.ok()) return Refuse(path, "something else", "an Ed25519 private key in PEM");
  return key;
}

absl::StatusOr<SigningKey> SigningKey::OfPem(const std::string& pem) {
  const Bio bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
  Key key(PEM_read_bio_PrivateKey(bio.get(), nullptr, nullptr, nullptr));
  if (key == nullptr || EVP_PKEY_id(key.get()) != EVP_PKEY_ED25519)
    return Refuse("key", "something else", "an Ed25519 private key in PEM");
  const Bio out(BIO_new(BIO_s_mem()));
  if (PEM_write_bio_PUBKEY(out.get(), key.get()) != 1) return absl::InternalError("OpenSSL writes no public key");
  SigningKey made(key.get());
  made.public_pem_ = TextIn(out);
  made.key_id_ = IdOf(key.get());
  key.release();  // made's
  return made;
}

absl::Status SigningKey::MakeFile(const std::string& path) {
  if (access(path.c_str(), F_OK) != 0) {
    const absl::StatusOr<std::string> pem = NewPem();
    if (!pem.ok()) return pem.status();
    if (absl::Status written = WriteWhole(path, *pem, 0600); !written.ok()) return written;
  }
  const absl::StatusOr<SigningKey> key = Read(path);
  if (!key.ok()) return key.status();
  return WriteWhole(std::filesystem::path(path).parent_path() / "public.pem", key->public_pem(), 0644);
}

SigningKey::SigningKey(SigningKey&& other) noexcept
    : key_(std::exchange(other.key_, nullptr)),
      public_pem_(std::move(other.public_pem_)),
      key_id_(std::move(other.key_id_)) {}

SigningKey::~SigningKey() { EVP_PKEY_free(static_cast<EVP_PKEY*>(key_)); }

absl::StatusOr<Head> SigningKey::Sign(Head head) const {
  head.key_id = key_id_;
  const std::string text = SignedText(head);
  std::array<unsigned char, kSignatureBytes> signature{};
  std::size_t size = signature.size();
  const Signing signing(EVP_MD_CTX_new());
  if (EVP_DigestSignInit(signing.get(), nullptr, nullptr, nullptr, static_cast<EVP_PKEY*>(key_)) != 1 ||
      EVP_DigestSign(signing.get(), signature.data(), &size, reinterpret_cast<const unsigned char*>(text.data()),
                     text.size()) != 1)
    return absl::InternalError("OpenSSL does not sign");
  head.signature.assign(reinterpret_cast<const char*>(signature.data()), size);
  return head;
}

absl::StatusOr<std::string> KeyIdOf(const std::string& public_pem) {
  const Key key = PublicKeyOf(public_pem);
  if (key == nullptr) return Refuse("key", public_pem.substr(0, 100), "an Ed25519 public key in PEM");
  return IdOf(key.get());
}

bool IsSignedBy(const Head& head, const std::string& public_pem) {
  const Key key = PublicKeyOf(public_pem);
  const Signing checking(EVP_MD_CTX_new());
  const std::string text = SignedText(head);
  return key != nullptr && EVP_DigestVerifyInit(checking.get(), nullptr, nullptr, nullptr, key.get()) == 1 &&
         EVP_DigestVerify(checking.get(), reinterpret_cast<const unsigned char*>(head.signature.data()),
                          head.signature.size(), reinterpret_cast<const unsigned char*>(text.data()), text.size()) == 1;
}

}  // namespace sixpoint::ledger
