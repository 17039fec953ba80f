#include "api/problem.h"

#include <algorithm>
#include <new>

#include "api/json_text.h"

namespace fstop::api {
namespace {

struct Answer {
  int status = 500;
  std::string_view slug = "internal";
};

Answer answer(ErrorCode code) {
  switch (code) {
    case ErrorCode::outside_domain:
      return {422, "outside-domain"};
    case ErrorCode::invalid_request:
      return {422, "invalid-request"};
    case ErrorCode::malformed_json:
      return {400, "json-invalid"};
    case ErrorCode::not_found:
      return {404, "not-found"};
    case ErrorCode::bad_geometry:
      return {422, "bad-geometry"};
    case ErrorCode::bad_image:
      return {422, "bad-image"};
    case ErrorCode::bad_path:
      return {422, "bad-path"};
    case ErrorCode::over_budget:
      return {422, "over-budget"};
    case ErrorCode::no_valid_method:
      return {422, "no-valid-method"};
    case ErrorCode::cancelled:
      return {503, "cancelled"};
    case ErrorCode::unsupported:
      return {422, "unsupported"};
    case ErrorCode::io_failure:
      return {500, "internal"};
    case ErrorCode::internal:
      return {500, "internal"};
  }
  return {500, "internal"};
}

std::string title_of(std::string_view slug) {
  std::string title(slug);
  std::ranges::replace(title, '-', ' ');
  if (title.starts_with("json")) title.replace(0, 4, "JSON");
  if (!title.empty() && title[0] >= 'a' && title[0] <= 'z')
    title[0] = static_cast<char>(title[0] - 'a' + 'A');
  return title;
}

std::string summary(const std::vector<FieldFault>& faults, std::size_t unlisted) {
  if (faults.empty()) return "the request is refused";
  std::string text = faults.front().pointer + " " + faults.front().detail;
  const std::size_t more = faults.size() - 1 + unlisted;
  if (more > 0) text += " (and " + std::to_string(more) + " more)";
  return text;
}

nlohmann::ordered_json json_of(const Problem& problem, std::size_t listed) {
  nlohmann::ordered_json value = {{"type", problem.type},
                                  {"title", problem.title},
                                  {"status", problem.status},
                                  {"detail", shortened(problem.detail, 1024)}};
  if (problem.prediction) {
    const CostPrediction& cost = *problem.prediction;
    value["prediction"] = {{"samples", cost.samples},
                           {"cpu_s", cost.cpu_s},
                           {"wall_s", cost.wall_s},
                           {"memory_bytes", cost.memory_bytes}};
  }
  if (problem.errors.empty()) return value;
  auto& errors = value["errors"] = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < listed; ++i) {
    const FieldFault& fault = problem.errors[i];
    errors.push_back(
        {{"pointer", shortened(fault.pointer, 512)}, {"detail", shortened(fault.detail, 1024)}});
  }
  if (const std::size_t rest = problem.errors.size() - listed + problem.unlisted; rest > 0) {
    errors.push_back(
        {{"pointer", "#"}, {"detail", std::to_string(rest) + " more faults are not listed"}});
  }
  return value;
}

}  // namespace

InvalidRequest::InvalidRequest(std::vector<FieldFault> faults, ErrorCode code, std::size_t unlisted)
    : Error(code, summary(faults, unlisted)), faults_(std::move(faults)), unlisted_(unlisted) {}

void FaultList::add(std::string_view pointer, std::string detail) {
  if (faults_.size() >= most_) {
    ++unlisted_;
    return;
  }
  faults_.push_back({shortened(pointer, 2 * Limits{}.echo_bytes), std::move(detail)});
}

void FaultList::throw_if_any() const {
  if (faults_.empty()) return;
  throw InvalidRequest(faults_, ErrorCode::invalid_request, unlisted_);
}

Problem problem(const std::exception& exception) {
  if (dynamic_cast<const std::bad_alloc*>(&exception) != nullptr) {
    return http_problem(503, "overloaded", "there is not enough memory for this now");
  }
  const auto* error = dynamic_cast<const Error*>(&exception);
  const Answer reply = answer(error == nullptr ? ErrorCode::internal : error->code());
  if (reply.status == 500)
    return http_problem(500, "internal", "the server failed; its log says why");
  Problem result = http_problem(reply.status, reply.slug, exception.what());
  if (const auto* invalid = dynamic_cast<const InvalidRequest*>(error)) {
    result.errors = invalid->faults();
    result.unlisted = invalid->unlisted();
  }
  return result;
}

Problem http_problem(int status, std::string_view slug, std::string detail) {
  return {.status = status,
          .type = "/problems/" + std::string(slug),
          .title = title_of(slug),
          .detail = std::move(detail),
          .errors = {},
          .unlisted = 0,
          .prediction = {}};
}

std::string to_json(const Problem& problem) {
  const std::size_t most = Limits{}.problem_bytes;
  std::size_t listed = problem.errors.size();
  for (;;) {
    std::string text = json_text(json_of(problem, listed));
    if (text.size() <= most || listed == 0) return text;
    // At least one fault less; the average length says about how many fit.
    listed = std::min(listed - 1, listed * most / text.size());
  }
}

std::string shortened(std::string_view text, std::size_t max_bytes) {
  constexpr std::string_view kEllipsis = "...";
  if (text.size() <= max_bytes) return std::string(text);
  std::size_t length = max_bytes - std::min(max_bytes, kEllipsis.size());
  const auto continues = [&](std::size_t i) {
    return (static_cast<unsigned char>(text[i]) & 0xC0) == 0x80;
  };
  while (length > 0 && continues(length)) --length;
  return std::string(text.substr(0, length)) + std::string(kEllipsis.substr(0, max_bytes));
}

}  // namespace fstop::api
