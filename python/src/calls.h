#pragma once

#include <nanobind/nanobind.h>

#include <functional>
#include <optional>
#include <type_traits>
#include <utility>

#include "its/base.h"

/// How calls of the library run from Python.
namespace its::python {

namespace nb = nanobind;

/// What Python says about how a call is to run.
struct Control {
    nb::object observer;  ///< None, or called as observer(stage, fraction) -> bool: whether to go on
    int threads = 0;
};

/// Runs body(run) on a thread of its own without the interpreter's lock, while this one, some twenty times a
/// second, looks for signals (Ctrl-C) and tells the observer how far the work is; the observer is told of the
/// end, too. An exception of either stops the work and is passed on once the work has stopped.
/// \throws what body throws; nb::python_error; Cancelled whenever the observer says no, at the end as well
void run_watched(const Control& control, const std::function<void(const Run&)>& body);

/// The same with a result.
template <class F>
auto watched(const Control& control, F&& fn) {
    using Result = std::invoke_result_t<F, const Run&>;
    if constexpr (std::is_void_v<Result>) {
        run_watched(control, fn);
    } else {
        std::optional<Result> result;
        run_watched(control, [&](const Run& run) { result.emplace(fn(run)); });
        return std::move(*result);
    }
}

/// For work on `count` items that takes too short a time to be watched if they are at most `few`: it then runs
/// here, without the interpreter's lock all the same.
template <class F>
void watched_if_many(const Control& control, std::uint64_t count, std::uint64_t few, F&& fn) {
    if (count > few || !control.observer.is_none()) {
        run_watched(control, fn);
        return;
    }
    const nb::gil_scoped_release released;
    fn(Run{.threads = control.threads});
}

}  // namespace its::python
