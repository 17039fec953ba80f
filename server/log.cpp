#include "server/log.h"

#include <array>
#include <charconv>
#include <cmath>

#include <spdlog/async.h>
#include <spdlog/async_logger.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include "core/error.h"

namespace fstop::server {
namespace {

constexpr std::size_t kQueuedLines = 8192;

spdlog::sink_ptr sink_of(const std::string& file) {
  if (file.empty()) return std::make_shared<spdlog::sinks::stderr_sink_mt>();
  try {
    return std::make_shared<spdlog::sinks::basic_file_sink_mt>(file);
  } catch (const spdlog::spdlog_ex& exception) {
    throw Error(ErrorCode::io_failure, exception.what());
  }
}

std::string joined(std::string_view event, const std::vector<LogField>& fields) {
  std::string line = "\"event\":" + json_string(event);
  for (const LogField& field : fields) line += "," + field.json();
  return line;
}

template <typename Number>
std::string digits(Number number) {
  std::array<char, 32> text = {};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
  return {text.data(), end};
}

std::string member(std::string_view name) { return json_string(name) + ":"; }

// Microseconds are enough; more digits are noise.
double rounded_ms(double ms) { return std::round(ms * 1000.0) / 1000.0; }

}  // namespace

std::string json_string(std::string_view text, std::size_t max_bytes) {
  constexpr std::string_view kHex = "0123456789abcdef";
  std::string quoted = "\"";
  for (const char c : text.substr(0, max_bytes)) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (byte < 0x20 || byte >= 0x7F) {
      quoted += "\\u00";
      quoted += kHex[byte >> 4U];
      quoted += kHex[byte & 0xFU];
    } else {
      quoted += c;
    }
  }
  if (text.size() > max_bytes) quoted += "...";
  return quoted + "\"";
}

LogField::LogField(std::string_view name, std::string_view text)
    : json_(member(name) + json_string(text, 1024)) {}
LogField::LogField(std::string_view name, double number)
    : json_(member(name) + (std::isfinite(number) ? digits(number) : "null")) {}
LogField::LogField(std::string_view name, long long number)
    : json_(member(name) + digits(number)) {}

Log::Log(const std::string& file)
    : threads_(std::make_shared<spdlog::details::thread_pool>(kQueuedLines, 1)),
      logger_(std::make_shared<spdlog::async_logger>(
          "fstop", sink_of(file), threads_, spdlog::async_overflow_policy::overrun_oldest)) {
  logger_->set_pattern(R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l",%v})",
                       spdlog::pattern_time_type::utc);
  logger_->flush_on(spdlog::level::info);
}

Log::~Log() { logger_->flush(); }

void Log::event(std::string_view name, const std::vector<LogField>& fields) {
  logger_->info("{}", joined(name, fields));
}

void Log::warning(std::string_view name, const std::vector<LogField>& fields) {
  logger_->warn("{}", joined(name, fields));
}

void Log::request(const RequestRecord& record) {
  std::vector<LogField> fields = {{"id", record.id},
                                  {"peer", record.peer},
                                  {"method", record.method},
                                  {"path", record.path},
                                  {"route", record.route},
                                  {"status", record.status},
                                  {"ms", rounded_ms(record.duration_ms)},
                                  {"bytes", static_cast<long long>(record.reply_bytes)}};
  if (!record.trace.trace_id.empty()) {
    fields.emplace_back("trace_id", record.trace.trace_id);
    fields.emplace_back("span_id", record.trace.span_id);
    if (!record.trace.parent_id.empty()) fields.emplace_back("parent_id", record.trace.parent_id);
  }
  if (!record.problem.empty()) fields.emplace_back("problem", record.problem);
  if (!record.render.empty()) fields.emplace_back("render", record.render);
  if (!record.error.empty()) fields.emplace_back("error", record.error);
  event("request", fields);
}

}  // namespace fstop::server
