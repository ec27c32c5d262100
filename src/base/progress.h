#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "base/parallel.h"

/// The progress of a call as a whole, which is made of stages.
namespace its {

/// A job's progress, dealt out from its beginning to parts that follow each other: as a part goes from 0 to 1,
/// the job goes from where the part before ended to where this one ends.
class Parts {
public:
    /// \param begin  where the first part begins
    explicit Parts(const Progress& job, double begin = 0) : job_(job), at_(begin) {}

    /// The next part, up to this fraction of the job.
    Progress until(double end) {
        const double begin = std::exchange(at_, std::max(at_, end));
        if (!job_) return {};
        return [job = job_, begin, width = at_ - begin](std::string_view stage, double fraction) {
            return job(stage, begin + width * fraction);
        };
    }

    /// The next part, with this share of what is left: for rounds whose number is not known.
    Progress next(double share) { return until(at_ + share * (1 - at_)); }

private:
    Progress job_;
    double at_;
};

/// Runs a public function, fn(progress), on the threads of `run`. Its progress begins at 0, never falls, and is
/// 1 at the end, whatever its stages report.
/// \param name  what it does until the first stage reports
template <class F>
auto run_call(const Run& run, std::string_view name, F&& fn) {
    require_threads(run.threads);
    std::string stage(name);
    double done = 0;
    Progress progress;
    if (run.progress)
        progress = [&](std::string_view now, double fraction) {
            stage = now;
            done = std::clamp(fraction, done, 1.0);
            return run.progress(now, done);
        };
    const auto report = [&](double fraction) {
        if (progress && !progress(std::string(stage), fraction)) throw Cancelled("stopped by the caller");
    };
    report(0);
    const auto finish = [&] {
        if (done < 1) report(1);
    };
    return with_threads(run.threads, [&] {
        if constexpr (std::is_void_v<std::invoke_result_t<F, const Progress&>>) {
            fn(std::as_const(progress));
            finish();
        } else {
            auto result = fn(std::as_const(progress));
            finish();
            return result;
        }
    });
}

}  // namespace its
