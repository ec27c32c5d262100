its_link_parts(test_shell_file)  # pictures are a further use of a damaged shell
