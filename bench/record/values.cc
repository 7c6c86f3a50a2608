#include "bench/record/values.h"

#include <optional>

#include "bench/ground/transactions.h"
#include "bench/record/beside.h"
#include "services/inspection/value_service.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::bench {
namespace {

using inspection::v1::ListValuesRequest;
using storage::Params;

constexpr char kCharacteristic[] = "G1/H1/position";
// What a value is, in the words of the tables. $1, $2: the characteristic's.
#define VALUES                                                                                             \
  "SELECT n.record_sequence, n.recorded_at, i.blade_serial, i.machine_id, i.machine_revision, i.part_id, " \
  "i.part_revision, i.method, i.inspection_id, h.position_error_mm, h.position_tolerance_mm, "             \
  "h.position_expanded_uncertainty_um, h.position_verdict FROM inspections i JOIN inspection_holes h "     \
  "ON h.inspection_id = i.inspection_id JOIN record_names n ON n.record_id = i.inspection_id "             \
  "WHERE h.group_name = $1 AND h.hole_name = $2 AND "
constexpr char kNewestFirst[] = " ORDER BY n.record_sequence DESC";

class Asked {
 public:
  explicit Asked(const std::string& conninfo)
      : database_(storage::Database::Open(conninfo, 4)),
        service_(storage::ValuesIn(database_.get())),
        server_({&service_}),
        stub_(inspection::v1::ValueService::NewStub(server_.Connect())) {}

  std::int64_t Sql(const std::string& sql, const Params& params) {
    storage::Transaction transaction = Begin(database_.get());
    return Must(transaction.Execute(sql, params)).count();
  }
  std::string Text(const std::string& sql) {
    storage::Transaction transaction = Begin(database_.get());
    return Must(transaction.Execute(sql)).Text(0, 0);
  }
  std::int64_t Download(const ListValuesRequest& values) {
    inspection::v1::DownloadValuesRequest request;
    *request.mutable_values() = values;
    grpc::ClientContext context;
    const auto reader = stub_->DownloadValues(&context, request);
    std::int64_t rows = 0;
    for (inspection::v1::ListValuesResponse page; reader->Read(&page);) rows += page.values_size();
    Check(reader->Finish());
    return rows;
  }
  // The token of the next page, empty where there is none.
  std::string Page(ListValuesRequest request, const std::string& token, std::int64_t* rows) {
    request.set_page_token(token);
    inspection::v1::ListValuesResponse response;
    grpc::ClientContext context;
    Check(stub_->ListValues(&context, request, &response));
    *rows = response.values_size();
    return response.next_page_token();
  }

 private:
  static void Check(const grpc::Status& status) {
    if (status.ok()) return;
    std::fprintf(stderr, "%s\n", status.error_message().c_str());
    std::exit(2);
  }
  const std::unique_ptr<storage::Database> database_;
  inspection::ValueService service_;
  testing::InProcessServer server_;
  const std::unique_ptr<inspection::v1::ValueService::Stub> stub_;
};

ListValuesRequest Usual(int page_size) {
  ListValuesRequest request;
  request.set_characteristic(kCharacteristic);
  request.set_page_size(page_size);
  return request;
}

Params Characteristic() { return Params().Text("G1").Text("H1"); }

// One filter as the contract has it, and as SQL.
struct Filter {
  std::string name;
  ListValuesRequest request;
  std::string sql;
  Params params;
  int page = 0;  // the deep one
};

nlohmann::json AskFilter(Asked* asked, const Filter& filter) {
  const int size = filter.request.page_size();
  std::string token;
  std::int64_t rows = 0;
  int page = 1;
  // As deep as it goes, if that is less.
  for (; page < filter.page; ++page) {
    const std::string next = asked->Page(filter.request, token, &rows);
    if (next.empty()) break;
    token = next;
  }
  const auto limited = [&](int offset) {
    return filter.sql + kNewestFirst + " LIMIT " + std::to_string(size) + " OFFSET " + std::to_string(offset);
  };
  const auto first = [&] {
    asked->Page(filter.request, "", &rows);
    return rows;
  };
  nlohmann::json found = Beside(
      first, [&] { return asked->Sql(limited(0), filter.params); }, 11);
  std::vector<double> first_s, deep_s, offset_s;
  for (int round = 0; round < 11; ++round) {
    first_s.push_back(Time(first).s);
    deep_s.push_back(Time([&] { return asked->Page(filter.request, token, &rows).size(); }).s);
  }
  for (int round = 0; round < 3; ++round)
    offset_s.push_back(Time([&] { return asked->Sql(limited(size * (page - 1)), filter.params); }).s);
  found["filter"] = filter.name;
  found["page"] = page;
  found["deep_s"] = Median(deep_s);
  found["depth"] = Median(deep_s) / Median(first_s);
  found["offset_s"] = Median(offset_s);
  return found;
}

}  // namespace

nlohmann::json AskValues(const std::string& conninfo, const std::string& machine) {
  Asked asked(conninfo);
  ListValuesRequest request = Usual(1000);
  request.set_machine("machines/" + machine);
  return Beside([&] { return asked.Download(request); },
                [&] {
                  return asked.Sql(std::string(VALUES "i.machine_id = $3") + kNewestFirst,
                                   Characteristic().Text(machine));
                });
}

nlohmann::json AskSearch(const std::string& conninfo, const std::string& machine) {
  Asked asked(conninfo);
  const std::string part = asked.Text("SELECT min(part_id) FROM parts WHERE part_id LIKE 'SEED-%'");
  const std::string serial = asked.Text("SELECT max(blade_serial) FROM blades WHERE blade_serial LIKE 'SEED-%'");
  // A tenth of all, and a hundredth.
  const std::string many = serial.substr(0, serial.size() - 4), few = serial.substr(0, serial.size() - 3);
  // The middle of what was recorded.
  const std::string span = asked.Text(
      "SELECT extract(epoch FROM percentile_disc(0.4) WITHIN GROUP (ORDER BY recorded_at))::bigint || ' ' || "
      "extract(epoch FROM percentile_disc(0.7) WITHIN GROUP (ORDER BY recorded_at))::bigint "
      "FROM record_entries WHERE kind = 'inspection'");
  const std::int64_t from = std::stoll(span), until = std::stoll(span.substr(span.find(' ')));
  std::vector<Filter> filters;
  const auto add = [&](const std::string& name, const std::string& condition, int size, int page) {
    filters.push_back({name, Usual(size), VALUES + condition, Characteristic(), page});
    return &filters.back();
  };
  Filter* filter = add("prefix_of_many", "starts_with(i.blade_serial, $3)", 100, 95);
  filter->request.set_serial_prefix(many);
  filter->params.Text(many);
  filter = add("prefix_of_few", "starts_with(i.blade_serial, $3)", 100, 9);
  filter->request.set_serial_prefix(few);
  filter->params.Text(few);
  filter = add("part", "i.part_id = $3", 100, 200);
  filter->request.set_part("parts/" + part);
  filter->params.Text(part);
  filter = add("machine", "i.machine_id = $3", 100, 90);
  filter->request.set_machine("machines/" + machine);
  filter->params.Text(machine);
  filter = add("time", "n.recorded_at >= to_timestamp($3) AND n.recorded_at < to_timestamp($4)", 100, 200);
  filter->request.mutable_recorded()->mutable_from()->set_seconds(from);
  filter->request.mutable_recorded()->mutable_until()->set_seconds(until);
  filter->params.Int(from).Int(until);
  filter = add("verdict_usual", "i.verdict = $3", 100, 800);
  filter->request.set_verdict(inspection::v1::VERDICT_CONFORM);
  filter->params.Text("CONFORM");
  filter = add("verdict_rare", "i.verdict = $3", 10, 20);
  filter->request.set_verdict(inspection::v1::VERDICT_NOT_CONFORM);
  filter->params.Text("NOT_CONFORM");
  nlohmann::json found = nlohmann::json::array();
  for (const Filter& one : filters) found.push_back(AskFilter(&asked, one));
  return found;
}

}  // namespace sixpoint::bench
