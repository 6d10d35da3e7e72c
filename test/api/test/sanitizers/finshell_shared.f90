! All objects come from libfinshell.a.
