#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "its/base.h"

#ifdef ITS_SANITIZE_THREAD
#include <exception>
#include <thread>
#else
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_sort.h>
#include <oneapi/tbb/task_arena.h>
#endif

/// The one parallel layer. Every loop is cut into chunks whose bounds depend on the count alone, never on the
/// number of threads: what a chunk computes, and the order of chunks, are the same for any number.
namespace its {

inline void require_threads(int threads) {
    if (threads < 0) throw OptionError("threads " + std::to_string(threads) + ": must be 0 or more");
}

#ifdef ITS_SANITIZE_THREAD
// ThreadSanitizer cannot see how Debian's TBB synchronises and would call every loop a race. Under it the same
// chunks run on plain threads, which it understands: it checks our loops, and TBB is trusted.
namespace detail {
inline thread_local int thread_limit = 4;

template <class F>
void run_chunks(std::uint64_t chunks, const F& run) {
    std::atomic<std::uint64_t> next = 0;
    std::exception_ptr error;
    std::mutex mutex;
    const auto work = [&](int limit) {
        thread_limit = limit;  // loops within a chunk
        try {
            for (std::uint64_t chunk = next++; chunk < chunks; chunk = next++) run(chunk);
        } catch (...) {
            const std::lock_guard lock(mutex);
            if (!error) error = std::current_exception();
            next = chunks;
        }
    };
    std::vector<std::thread> threads;
    for (int i = 1; i < thread_limit; ++i) threads.emplace_back(work, 1);
    work(thread_limit);
    for (std::thread& thread : threads) thread.join();
    if (error) std::rethrow_exception(error);
}
}  // namespace detail

/// Sorts whole numbers: equal ones are the same, so that any way to sort gives the same.
inline void parallel_sort(std::vector<std::uint64_t>& keys) {
    std::sort(keys.begin(), keys.end());
}

/// Runs fn with at most `threads` threads (0: four).
/// \throws OptionError if negative
template <class F>
auto with_threads(int threads, F&& fn) {
    require_threads(threads);
    struct Restore {
        int limit = detail::thread_limit;
        ~Restore() { detail::thread_limit = limit; }
    } restore;
    detail::thread_limit = threads > 0 ? std::min(threads, restore.limit) : restore.limit;
    return std::forward<F>(fn)();
}
#else
namespace detail {
template <class F>
void run_chunks(std::uint64_t chunks, const F& run) {
    oneapi::tbb::parallel_for(std::uint64_t{0}, chunks, run);
}
}  // namespace detail

/// Sorts whole numbers: equal ones are the same, so that any way to sort gives the same.
inline void parallel_sort(std::vector<std::uint64_t>& keys) {
    oneapi::tbb::parallel_sort(keys.begin(), keys.end());
}

/// Runs fn with at most `threads` threads (0: all of the machine), and never more than the machine has (TBB
/// would print a warning) or an enclosing with_threads() allows: a public function may call another as it is.
/// \throws OptionError if negative
template <class F>
auto with_threads(int threads, F&& fn) {
    require_threads(threads);
    const int all =
        std::min(oneapi::tbb::info::default_concurrency(), oneapi::tbb::this_task_arena::max_concurrency());
    oneapi::tbb::task_arena arena(threads > 0 ? std::min(threads, all) : all);
    return arena.execute(std::forward<F>(fn));
}
#endif

/// Counts the work of a stage, reports it, and passes on the wish to stop. Thread-safe.
class Stage {
public:
    Stage(Progress progress, std::string_view name, std::uint64_t total)
        : progress_(std::move(progress)), name_(name), total_(std::max<std::uint64_t>(total, 1)) {
        report(0.0);
    }

    /// Says that `count` more units are done.
    /// \throws Cancelled
    void advance(std::uint64_t count) {
        if (!progress_) return;
        if (stopped_.load(std::memory_order_relaxed)) throw Cancelled("stopped by the caller");
        const std::uint64_t done = done_.fetch_add(count, std::memory_order_relaxed) + count;
        if (percent(done) != percent(done - count) || is_due()) report(double(done) / double(total_));
    }

private:
    using Clock = std::chrono::steady_clock;
    static constexpr Clock::duration longest_silence = std::chrono::milliseconds(50);

    int percent(std::uint64_t done) const { return int(100 * (double(done) / double(total_))); }

    /// Whether nothing was reported for a while. One thread gets to hear it.
    bool is_due() {
        const Clock::rep now = Clock::now().time_since_epoch().count();
        Clock::rep due = due_.load(std::memory_order_relaxed);
        return now >= due && due_.compare_exchange_strong(due, now + longest_silence.count());
    }

    void report(double fraction) {
        if (!progress_) return;
        const std::lock_guard lock(mutex_);
        reported_ = std::max(reported_, std::min(fraction, 1.0));  // threads may report in another order
        if (!stopped_ && !progress_(name_, reported_)) stopped_ = true;
        if (stopped_) throw Cancelled("stopped by the caller");
    }

    Progress progress_;
    std::string_view name_;
    std::uint64_t total_;
    double reported_ = 0;
    std::atomic<std::uint64_t> done_ = 0;
    std::atomic<Clock::rep> due_ = (Clock::now() + longest_silence).time_since_epoch().count();
    std::atomic<bool> stopped_ = false;
    std::mutex mutex_;
};

/// fn(chunk, begin, end) for consecutive chunks of `grain` items (the last may be shorter); serial when there
/// is but one. Exceptions of fn are passed on.
template <class F>
void for_chunks(std::uint64_t count, std::uint64_t grain, F&& fn) {
    const std::uint64_t chunks = (count + grain - 1) / grain;
    const auto run = [&](std::uint64_t chunk) {
        fn(chunk, chunk * grain, std::min(count, (chunk + 1) * grain));
    };
    if (chunks <= 1) {
        if (chunks == 1) run(0);
        return;
    }
    detail::run_chunks(chunks, run);
}

inline std::uint64_t chunk_count(std::uint64_t count, std::uint64_t grain) {
    return (count + grain - 1) / grain;
}

/// fn(i) for all i in [0, count), `grain` items a chunk.
template <class F>
void parallel_for(std::uint64_t count, std::uint64_t grain, F&& fn) {
    for_chunks(count, grain, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t i = begin; i < end; ++i) fn(i);
    });
}

/// add(fn(begin, end)) for chunks of `grain` items each, in their order: fn in parallel, add not. Only some
/// thousand results are kept at a time, so that any count takes little memory.
template <class F, class Add>
void fold_chunks(std::uint64_t count, std::uint64_t grain, F&& fn, Add&& add) {
    const std::uint64_t round = 4096 * grain;
    std::vector<std::invoke_result_t<F, std::uint64_t, std::uint64_t>> results;
    for (std::uint64_t done = 0; done < count;) {
        const std::uint64_t n = std::min(round, count - done);
        results.resize(chunk_count(n, grain));
        for_chunks(n, grain, [&](std::uint64_t chunk, std::uint64_t begin, std::uint64_t end) {
            results[chunk] = fn(done + begin, done + end);
        });
        for (const auto& result : results) add(result);
        done += n;
    }
}

}  // namespace its
