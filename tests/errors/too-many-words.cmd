hal check --ini too-many-words.ini too-many-words.hal
