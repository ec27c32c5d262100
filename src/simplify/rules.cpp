#include "simplify/rules.h"

#include "shell/access.h"

#include <algorithm>
#include <cmath>

namespace its::simplifier {

CollapseRule::Verdict VertexInShell::test(const Collapse& collapse, const Complex&, double) {
    const double f = shell_.value(collapse.to);
    return {shell_.info().epsilon_inner < f && f < shell_.info().epsilon_outer};
}

double ShellPriority::extra_cost(const Vec3& to) const {
    const double f = shell_.value(to) / shell_.info().scale;
    return gamma_ * f * f;
}

Certified::Certified(const Complex& original, bool keep_tolerance, const ThinShell* shell) {
    if (keep_tolerance) deviation_.emplace(original);
    if (shell != nullptr) shell_.emplace(shell::Access::data(*shell));
}

CollapseRule::Verdict Certified::test(const Collapse& collapse, const Complex& current, double tolerance) {
    if (deviation_) {
        frames_.clear();
        for (const auto& p : collapse.corners) frames_.push_back(make_frame(p[0], p[1], p[2]));
        const auto verdict = deviation_->test(collapse.ring, collapse.faces(), frames_, current, tolerance);
        // A proof that failed for no certain reason may do with any larger tolerance.
        if (!verdict.proven) return {false, std::max(verdict.need, std::nextafter(tolerance, infinite))};
    }
    if (shell_) {
        for (const auto& p : collapse.corners) {
            if (shell_->in_shell(p[0], p[1], p[2])) continue;
            ++refused_by_shell_;
            return {false};
        }
    }
    return {true};
}

void Certified::accept(const Collapse&, const Complex&) {
    if (deviation_) deviation_->accept();
}

bool WithoutIntersections::intersects(const Collapse& collapse, const Complex& current) {
    patch_.clear();
    for (std::size_t i = 0; i < collapse.corners.size(); ++i) {
        Triangle number = current.triangle(collapse.faces()[i]);
        for (std::uint32_t& w : number)
            if (w == collapse.u) w = collapse.v;
        patch_.push_back({number, collapse.corners[i]});
    }
    for (std::size_t i = 0; i < patch_.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j)
            if (intersect(patch_[i], patch_[j])) return true;
        if (grid_.meets(patch_[i], current, collapse.ring)) return true;
    }
    return false;
}

CollapseRule::Verdict WithoutIntersections::test(const Collapse& collapse, const Complex& current,
                                                 double tolerance) {
    const Verdict verdict = rule_.test(collapse, current, tolerance);
    if (!verdict.allowed) return verdict;
    return {!intersects(collapse, current)};
}

void WithoutIntersections::accept(const Collapse& collapse, const Complex& current) {
    rule_.accept(collapse, current);
    for (const std::uint32_t t : collapse.ring) grid_.remove(t, current);
}

void WithoutIntersections::made(const Collapse& collapse, const Complex& current) {
    for (const std::uint32_t t : collapse.faces()) grid_.insert(t, current);
}

}  // namespace its::simplifier
