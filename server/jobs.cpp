#include "server/jobs.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "api/secret.h"
#include "server/session.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;
using asio::experimental::awaitable_operators::operator||;
using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t kNameBytes = 16;  // 128 bits: not to be guessed
constexpr std::size_t kLifeBytes = 4;
constexpr double kLeastTold = 0.02;  // a fraction below says nothing of the time left

asio::awaitable<void> wait_for(asio::steady_timer& timer) {
  co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
}

// By the fraction, as the method counts it, and by the error that is still to go, whichever is
// longer: noise falls with samples as N^-0.6 (core/render/progressive.h).
std::optional<double> remaining_ms(const Job& job, const Progress::State& progress) {
  constexpr double kSamplesPerError = 1.0 / 0.6;
  using Milliseconds = std::chrono::duration<double, std::milli>;
  const auto now = SteadyClock::now();
  std::optional<double> left;
  if (progress.fraction >= kLeastTold) {
    const Milliseconds so_far = now - progress.started;
    left = so_far.count() * (1.0 - progress.fraction) / progress.fraction;
  }
  if (job.order.max_error > 0.0 && std::isfinite(progress.upper_95)) {
    const Milliseconds until_shown = progress.shown - progress.started;
    const double more = std::pow(progress.upper_95 / job.order.max_error, kSamplesPerError) - 1.0;
    const double by_error = until_shown.count() * more - Milliseconds(now - progress.shown).count();
    left = std::max({left.value_or(0.0), by_error, 0.0});
  }
  return left;
}

std::string_view word_of(const Job& job, const Progress::State& progress) {
  switch (job.state) {
    case Job::State::active:
      return progress.started == Progress::Time{} ? "queued" : "running";
    case Job::State::done:
      return "done";
    case Job::State::failed:
      return "failed";
    case Job::State::cancelled:
      return "cancelled";
  }
  return "failed";
}

}  // namespace

std::uint64_t Job::version() const { return progress().version + (state == State::active ? 0 : 1); }

void Jobs::refuse_if_full() {
  forget_old();
  while (jobs_.size() >= static_cast<std::size_t>(limits_.jobs) && !ended_.empty()) {
    forget(ended_.front());
    ended_.pop_front();
  }
  if (jobs_.size() < static_cast<std::size_t>(limits_.jobs)) return;
  throw Refusal(http::status::service_unavailable, "overloaded", "too many jobs are under way")
      .with("Retry-After", "5");
}

std::shared_ptr<Job> Jobs::add(JobOrder order, RenderQueue::Ticket ticket) {
  refuse_if_full();
  const std::shared_ptr<Job> job = known(std::move(order));
  begin(job, std::move(ticket));
  return job;
}

std::shared_ptr<Job> Jobs::restore(JobOrder order) { return known(std::move(order)); }

std::shared_ptr<Job> Jobs::known(JobOrder order) {
  auto job = std::make_shared<Job>();
  job->order = std::move(order);
  job->name = job->order.name.empty() ? api::random_hex(kNameBytes) : job->order.name;
  job->life = api::random_hex(kLifeBytes);
  job->expiry = std::make_unique<asio::steady_timer>(
      context_, job->order.deadline.value_or(SteadyClock::time_point::max()));
  jobs_.emplace(job->name, job);
  log_.event("job", {{"job", job->name.substr(0, 8)}, {"render", job->order.render}});
  return job;
}

void Jobs::begin(const std::shared_ptr<Job>& job, RenderQueue::Ticket ticket) {
  if (job->state != Job::State::active) return;  // withdrawn before it had begun
  job->ticket.emplace(std::move(ticket));
  ++active_;
  asio::co_spawn(context_, watch(job), asio::detached);
}

void Jobs::settle(const std::shared_ptr<Job>& job, const std::exception_ptr& failure) {
  if (job->state != Job::State::active) return;
  if (failure) fail(*job, failure);
  end(*job, failure ? Job::State::failed : Job::State::done);
  ended_.push_back(job);
}

void Jobs::fail(Job& job, const std::exception_ptr& failure) {
  RequestRecord record;
  const Reply reply = reply_of(failure, record);
  job.problem.assign(reply.bytes().data(), reply.bytes().size());
}

void Jobs::forget(const std::shared_ptr<Job>& job) {
  jobs_.erase(job->name);
  notes_.forget(job->name);
}

std::shared_ptr<Job> Jobs::look_up(const std::string& name) {
  forget_old();
  const auto found = jobs_.find(name);
  return found == jobs_.end() ? nullptr : found->second;
}

std::shared_ptr<Job> Jobs::find(const std::string& name) {
  if (auto job = look_up(name)) return job;
  throw Refusal(
      http::status::not_found, "not-found",
      "there is no such job: it ended too long ago, or the server, which keeps jobs in its data "
      "directory alone, has begun anew without one. What was asked for can be asked for again");
}

// Until the render has ended, the client's time has run out or the job was withdrawn.
asio::awaitable<void> Jobs::watch(std::shared_ptr<Job> job) {
  co_await (job->ticket->ended() || wait_for(*job->expiry));
  if (job->state != Job::State::active) co_return;
  std::exception_ptr failure;
  try {
    if (!job->ticket->has_ended()) {
      throw Refusal(http::status::gateway_timeout, "deadline",
                    "the render was not done when the client's time had run out");
    }
    auto result = std::static_pointer_cast<StoredRender>(job->ticket->result());
    if (!job->order.is_kept && !job->order.is_sweep) job->result = std::move(result);
  } catch (...) {
    failure = std::current_exception();
  }
  if (failure) fail(*job, failure);
  end(*job, failure ? Job::State::failed : Job::State::done);
  ended_.push_back(job);
  bound_results();
}

void Jobs::end(Job& job, Job::State state) {
  job.state = state;
  if (job.ticket) {
    job.last = job.ticket->progress();
    --active_;
  }
  job.last.preview.reset();
  if (state == Job::State::done) job.last.fraction = 1.0;
  job.ended = SteadyClock::now();
  job.ticket.reset();
  job.order.waiting_for = nullptr;  // what they hold is of the work
  job.order.withdrawn = nullptr;
  log_.event("job_ended", {{"job", job.name.substr(0, 8)},
                           {"render", job.order.render},
                           {"state", word_of(job, job.last)}});
}

void Jobs::withdraw(const std::shared_ptr<Job>& job) {
  if (job->state != Job::State::active) {
    forget(job);
    std::erase(ended_, job);
    return;
  }
  notes_.forget(job->name);
  if (job->order.withdrawn) job->order.withdrawn(job->name);
  end(*job, Job::State::cancelled);
  ended_.push_back(job);
  job->expiry->cancel();  // wakes the watch
}

void Jobs::forget_old() {
  const auto latest = SteadyClock::now() - limits_.job_retention;
  while (!ended_.empty() && ended_.front()->ended < latest) {
    forget(ended_.front());
    ended_.pop_front();
  }
}

// Results that only their jobs hold: the newest, within their bound.
void Jobs::bound_results() {
  std::size_t bytes = 0;
  for (auto job = ended_.rbegin(); job != ended_.rend(); ++job) {
    if (!(*job)->result) continue;
    bytes += (*job)->result->bytes();
    if (bytes > limits_.kept_job_bytes && job != ended_.rbegin()) (*job)->result.reset();
  }
}

std::shared_ptr<Job> Jobs::repeated(const std::string& key, const std::string& fingerprint) {
  const auto found = keys_.find(key);
  if (found == keys_.end()) return nullptr;
  if (found->second.fingerprint != fingerprint) {
    throw Refusal(http::status::unprocessable_entity, "idempotency-key-reused",
                  "an earlier request with this Idempotency-Key was another one");
  }
  return look_up(found->second.job);
}

void Jobs::remember(const std::string& key, const std::string& fingerprint,
                    const std::string& job) {
  const auto [place, is_new] = keys_.insert_or_assign(key, Earlier{fingerprint, job});
  if (is_new) key_order_.push_back(key);
  while (key_order_.size() > static_cast<std::size_t>(limits_.idempotency_keys)) {
    keys_.erase(key_order_.front());
    key_order_.pop_front();
  }
}

api::JobView view_of(const Job& job) {
  const Progress::State progress = job.progress();
  api::JobView view{.job = job.name,
                    .state = std::string(word_of(job, progress)),
                    .render = job.order.render,
                    .is_sweep = job.order.is_sweep,
                    .queue_place = job.ticket ? job.ticket->place() : 0,
                    .fraction = progress.fraction,
                    .previews = progress.previews,
                    .is_kept = job.order.is_kept,
                    .problem = job.problem};
  if (std::isfinite(progress.upper_95)) view.upper_95 = progress.upper_95;
  if (job.state == Job::State::active && job.order.waiting_for)
    view.waiting_for = job.order.waiting_for();
  const bool runs = job.state == Job::State::active && progress.started != Progress::Time{};
  if (runs) view.remaining_ms = remaining_ms(job, progress);
  return view;
}

}  // namespace fstop::server
