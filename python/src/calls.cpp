#include "calls.h"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

namespace its::python {

namespace {

constexpr auto interval = std::chrono::milliseconds(50);

/// What the working thread and the one that watches it tell each other.
class Work {
public:
    /// On the working thread.
    void run(int threads, const std::function<void(const Run&)>& body) {
        try {
            body({.threads = threads, .progress = [this](std::string_view stage, double fraction) {
                      const std::lock_guard lock(mutex_);
                      stage_ = stage;
                      fraction_ = fraction;
                      return !stop_;
                  }});
        } catch (...) {
            error_ = std::current_exception();
        }
        const std::lock_guard lock(mutex_);
        done_ = true;
        changed_.notify_one();
    }

    /// Waits until the work is done or the interval is over; whether it is done.
    bool wait() {
        std::unique_lock lock(mutex_);
        return changed_.wait_for(lock, interval, [this] { return done_; });
    }

    void stop() {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }

    bool stopped() {
        const std::lock_guard lock(mutex_);
        return stop_;
    }

    std::pair<std::string, double> progress() {
        const std::lock_guard lock(mutex_);
        return {stage_, fraction_};
    }

    /// Once it is done.
    std::exception_ptr error() const { return error_; }

private:
    std::mutex mutex_;
    std::condition_variable changed_;
    bool done_ = false, stop_ = false;
    std::string stage_;
    double fraction_ = 0;
    std::exception_ptr error_;
};

/// Tells the observer; whether to go on.
/// \throws nb::python_error
bool tell(const Control& control, Work& work) {
    if (control.observer.is_none()) return true;
    const auto [stage, fraction] = work.progress();
    if (stage.empty()) return true;  // it has not begun
    return nb::cast<bool>(control.observer(nb::str(stage.data(), stage.size()), fraction));
}

/// \throws nb::python_error
void look_for_signals() {
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
}

}  // namespace

void run_watched(const Control& control, const std::function<void(const Run&)>& body) {
    Work work;
    std::optional<nb::python_error> raised;
    const auto guarded = [&](const auto& look) {
        try {
            if (!look()) work.stop();
        } catch (nb::python_error& error) {
            raised.emplace(std::move(error));
            work.stop();
        }
    };
    {
        const nb::gil_scoped_release released;
        const std::jthread worker([&] { work.run(control.threads, body); });
        while (!work.wait()) {
            const nb::gil_scoped_acquire acquired;
            if (!raised) guarded([&] { return look_for_signals(), tell(control, work); });
        }
    }
    if (!raised && !work.error()) guarded([&] { return tell(control, work); });
    if (raised) throw std::move(*raised);
    if (work.error()) std::rethrow_exception(work.error());
    if (work.stopped())
        throw Cancelled("stopped by the caller");  // even where the work ended before it saw that
}

}  // namespace its::python
