# Libraries that single modules need, beside those every module may use.
