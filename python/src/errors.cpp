#include "module.h"

#include <cstring>
#include <exception>
#include <new>

#include "its/base.h"

namespace its::python {

namespace {

/// Raises its._errors.NAME. Text that is no UTF-8, of a file's name, is shown with backslashes.
void raise(const char* name, const char* what) {
    const nb::object type = nb::module_::import_("its._errors").attr(name);
    const auto message =
        nb::steal(PyUnicode_DecodeUTF8(what, nb::ssize_t(std::strlen(what)), "backslashreplace"));
    if (message.is_valid()) PyErr_SetObject(type.ptr(), message.ptr());
}

void translate(const std::exception_ptr& exception, void*) {
    try {
        std::rethrow_exception(exception);
    } catch (const InputError& error) {
        raise("InputError", error.what());
    } catch (const OptionError& error) {
        raise("OptionError", error.what());
    } catch (const FileError& error) {
        raise("FileError", error.what());
    } catch (const MemoryError& error) {
        raise("MemoryLimitError", error.what());
    } catch (const Cancelled& error) {
        raise("Cancelled", error.what());
    } catch (const Error& error) {
        raise("Error", error.what());
    } catch (const std::bad_alloc&) {
        raise("MemoryLimitError", "the machine has no more memory");
    }
}

}  // namespace

void bind_errors(nb::module_&) {
    nb::register_exception_translator(translate);
}

}  // namespace its::python
