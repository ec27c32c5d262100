#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "its/shell.h"
#include "shell/triangle_bounds.h"
#include "simplify/decimate.h"
#include "simplify/deviation.h"
#include "simplify/intersections.h"

/// The rules of the methods.
namespace its::simplifier {

/// Any collapse.
class AnyCollapse : public CollapseRule {
public:
    Verdict test(const Collapse&, const Complex&, double) override { return {true}; }
    void accept(const Collapse&, const Complex&) override {}
};

/// The paper's first way: ε₁ < f < ε₂ at the new vertex.
class VertexInShell : public CollapseRule {
public:
    explicit VertexInShell(const ThinShell& shell) : shell_(shell) {}
    Verdict test(const Collapse& collapse, const Complex& current, double tolerance) override;
    void accept(const Collapse&, const Complex&) override {}

private:
    const ThinShell& shell_;
};

/// The paper's second way: γ f² more, in units of the unit box.
class ShellPriority : public CollapseRule {
public:
    ShellPriority(const ThinShell& shell, double gamma) : shell_(shell), gamma_(gamma) {}
    double extra_cost(const Vec3& to) const override;
    Verdict test(const Collapse&, const Complex&, double) override { return {true}; }
    void accept(const Collapse&, const Complex&) override {}

private:
    const ThinShell& shell_;
    double gamma_;
};

/// Every new triangle in the shell, if there is one, and everything within the tolerance, if that is kept.
class Certified : public CollapseRule {
public:
    Certified(const Complex& original, bool keep_tolerance, const ThinShell* shell);
    Verdict test(const Collapse& collapse, const Complex& current, double tolerance) override;
    void accept(const Collapse&, const Complex&) override;

    const Deviation* deviation() const { return deviation_ ? &*deviation_ : nullptr; }
    std::uint64_t refused_by_shell() const { return refused_by_shell_; }

private:
    std::optional<Deviation> deviation_;
    std::optional<shell::TriangleBounds> shell_;
    std::vector<Frame> frames_;
    std::uint64_t refused_by_shell_ = 0;
};

/// Another rule, and no new intersections.
class WithoutIntersections : public CollapseRule {
public:
    WithoutIntersections(CollapseRule& rule, const Complex& mesh) : rule_(rule), grid_(mesh) {}
    double extra_cost(const Vec3& to) const override { return rule_.extra_cost(to); }
    Verdict test(const Collapse& collapse, const Complex& current, double tolerance) override;
    void accept(const Collapse& collapse, const Complex& current) override;
    void made(const Collapse& collapse, const Complex& current) override;

private:
    bool intersects(const Collapse& collapse, const Complex& current);

    CollapseRule& rule_;
    TriangleGrid grid_;
    std::vector<NumberedTriangle> patch_;
};

}  // namespace its::simplifier
