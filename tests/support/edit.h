#pragma once

#include <vector>

#include "base/array.h"

/// Arrays of a shell cannot be changed; tests that must harm one replace it by a changed copy.
namespace its::test {

/// A copy of an array's elements; put in the array's place when this object goes.
template <class T>
class Edit {
public:
    explicit Edit(Array<T>& array) : array_(array), elements_(array.begin(), array.end()) {}
    ~Edit() { array_ = std::move(elements_); }
    Edit(const Edit&) = delete;
    Edit& operator=(const Edit&) = delete;

    T& operator[](std::size_t i) { return elements_[i]; }
    std::vector<T>* operator->() { return &elements_; }
    std::vector<T>& operator*() { return elements_; }

private:
    Array<T>& array_;
    std::vector<T> elements_;
};

/// `edit(array)[3] = x;` or `edit(array)->pop_back();`
template <class T>
Edit<T> edit(Array<T>& array) {
    return Edit<T>(array);
}

}  // namespace its::test
